//! These tests check lights and their techniques: laws, accuracy, and hostile input.

mod accuracy;
mod accuracy_page;
mod accuracy_table;
mod areas;
mod constructed;
mod environments;
mod hostile;
mod laws;
mod linear;
mod next_to_the_plane;
mod octahedral;
mod precise;
mod profile_values;
mod profiles;
mod reference;
mod regions;
mod robust;
mod round;
mod shapes;
mod skies;
mod sky_values;
mod solid_angle;
mod spaces;
mod surfaces;
mod textures;
mod vectors;

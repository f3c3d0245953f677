//! Lights and their techniques: laws, accuracy, and hostile input.

#[allow(
    dead_code,
    reason = "what the workshop writes of a row is not tested here"
)]
mod accuracy;
mod accuracy_page;
mod areas;
mod hostile;
mod laws;
mod linear;
mod next_to_the_plane;
mod peters_as_printed;
mod precise;
mod reference;
mod regions;
mod robust;
mod solid_angle;
mod textures;
mod vectors;

//! Tests of pictures of small scenes, in which estimators are compared with each other.

mod agreement;
mod common;
mod corners;
mod cutouts;
mod exact;
mod far_away;
mod footprints;
mod large_floors;
mod linear;
mod materials;
mod means;
mod methods;
mod mixes;
mod orders;
mod own_renderer;
mod responses;
mod rows;
mod selection;
mod skies;
mod splits;
mod textures;
mod weights;

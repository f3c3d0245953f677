//! The model of a scene, which readers of files build and renderers read: meshes, camera,
//! materials, textures and emission.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod alpha;
mod builder;
mod camera;
mod differential;
mod emission;
mod emission_texture;
mod film;
mod footprint;
mod image;
mod material;
mod merge;
mod mipmap;
mod parameters;
mod response;
mod round;
mod scene;
mod surface;
mod texture;

pub use alpha::{Alpha, AlphaGrid};
pub use builder::{AddError, Added, MAX_COORDINATE, MeshData, Placement, SceneBuilder};
pub use camera::{Camera, CameraRay, Projection};
pub use emission::{EmissionMap, EmissionSpec, PlaneUv};
pub use emission_texture::EmissionTexture;
pub use film::FilmSettings;
pub use footprint::{Footprint, RayDifferential};
pub use image::{ImageData, LUMINANCE};
pub use material::{BumpMap, Material, MaterialKind, NormalMap, Remap, Roughness};
pub use parameters::Parameter;
pub use response::{Bounce, Response, index_of_refraction};
pub use round::RoundShape;
pub use scene::{Cutout, Mesh, Placed, RoundLight, SceneDescription, SceneLight};
pub use surface::{Covered, Surface};
pub use texture::{ImageTexture, Texture, TextureFilter, UvMapping, Wrap};

// Public signatures name types of these crates, so that users need only one dependency.
pub use {linelit_bsdf as bsdf, linelit_geometry as geometry, linelit_lights as lights};

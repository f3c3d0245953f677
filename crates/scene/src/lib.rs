#![doc = include_str!("../README.md")]
//!
//! # What a scene is
//!
//! A [`Scene`] is flat: all instances expanded, all positions in world space and rounded once to
//! `f32`, triangles with their material and, if they emit, their light.
//!
//! ```
//! use linelit_geometry::DVec3;
//! use linelit_scene::{LoadOptions, Scene};
//!
//! let text = r#"
//!     LookAt 0 1 -4  0 1 0  0 1 0
//!     Camera "perspective" "float fov" 40
//!     WorldBegin
//!     Material "matte" "rgb Kd" [ 0.5 0.5 0.5 ]
//!     Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
//!         "point3 P" [ -1 0 -1   1 0 -1   1 0 1   -1 0 1 ]
//!     AttributeBegin
//!         AreaLightSource "diffuse" "rgb L" [ 10 10 10 ]
//!         Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
//!             "point3 P" [ -.2 2 -.2   .2 2 -.2   .2 2 .2   -.2 2 .2 ]
//!     AttributeEnd
//! "#;
//! let loaded = Scene::from_pbrt_str(text, "room.pbrt", &LoadOptions::default())?;
//! let scene = loaded.scene;
//! assert!(loaded.warnings.is_empty());
//! assert_eq!((scene.triangles.len(), scene.lights.len()), (4, 1)); // two triangles, one quad
//!
//! // A ray has met the third triangle from below: it is the light.
//! let surface = scene.surface(2, [0.25, 0.25], DVec3::Y);
//! assert_eq!((surface.light, surface.outside), (Some(0), true));
//! assert_eq!(surface.geometric_normal, -DVec3::Y);
//! # Ok::<(), linelit_scene::SceneError>(())
//! ```

mod assembly;
mod camera;
mod color;
mod decode;
mod emission;
mod error;
mod export;
mod film;
mod footprint;
mod framing;
#[cfg(feature = "gltf")]
mod gltf;
mod gzip;
mod image;
#[cfg(feature = "jpeg")]
mod jpeg;
mod load;
mod material;
mod merge;
mod mesh;
mod mipmap;
mod monotone;
mod obj;
mod pbrt;
mod ply;
mod png;
mod polygon;
mod scene;
mod source;
mod suggest;
mod surface;
mod tessellate;
mod texture;
mod tga;

pub use camera::{Camera, CameraRay, Projection};
pub use emission::{EmissionMap, PlaneUv};
pub use error::{ErrorKind, SceneError, Warning};
pub use export::ExportOptions;
pub use film::{FilmSettings, Filter, FilterKind};
pub use footprint::{Footprint, RayDifferential};
pub use image::ImageData;
pub use load::{Format, LoadOptions, Loaded, Root};
pub use material::{BumpMap, Material, MaterialKind, NormalMap, Remap, Roughness};
pub use scene::{EmissiveSphere, Mesh, Scene, SceneLight};
pub use surface::{Covered, Surface};
pub use texture::{ImageTexture, Texture, TextureFilter, UvMapping, Wrap};

//! Scenes for linelit: geometry, lights, materials, camera and film, read from the files that
//! people have, with errors that name the place.
//!
//! A [`Scene`] is flat: all instances expanded, all positions in world space and rounded once to
//! `f32`, triangles with their material and, if they emit, their light. Emissive triangles that
//! together form a convex polygon are one light.
//!
//! ```
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
//! assert_eq!(loaded.scene.triangles.len(), 4);
//! assert_eq!(loaded.scene.lights.len(), 1); // two triangles, one quad
//! assert!(loaded.warnings.is_empty());
//! # Ok::<(), linelit_scene::SceneError>(())
//! ```

mod assembly;
mod camera;
mod color;
mod error;
mod export;
mod film;
mod gltf;
mod image;
mod inflate;
mod load;
mod material;
mod merge;
mod mesh;
mod obj;
mod pbrt;
mod ply;
mod png;
mod polygon;
mod scene;
mod source;
mod suggest;
mod tessellate;
mod texture;

pub use camera::{Camera, CameraRay, Projection};
pub use error::{ErrorKind, SceneError, Warning};
pub use film::{FilmSettings, Filter, FilterKind};
pub use image::ImageData;
pub use load::{Format, LoadOptions, Loaded};
pub use material::{Material, MaterialKind, Remap, Roughness};
pub use scene::{EmissiveSphere, Mesh, Scene, SceneLight, Surface};
pub use texture::{ImageTexture, Texture, UvMapping, Wrap};

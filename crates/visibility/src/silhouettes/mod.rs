//! The silhouettes of fine meshes: what such a mesh hides, found without a test of each of its
//! triangles. [`crossings`] is about lines, [`outline`] about a whole light, and both use the
//! search in [`silhouette`].

pub(crate) mod crossings;
pub(crate) mod outline;
pub(crate) mod silhouette;
mod turning;

//! The silhouettes of fine meshes: what these hide, without looking at each of their triangles.

pub(crate) mod crossings;
pub(crate) mod outline;
pub(crate) mod silhouette;
mod turning;

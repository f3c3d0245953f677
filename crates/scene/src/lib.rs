//! The scene model, cameras, materials and loaders (pbrt v3 and v4 text, PLY) with precise errors.

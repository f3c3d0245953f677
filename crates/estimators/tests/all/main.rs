//! Estimators on a renderer of one's own, and their texts.

mod own_renderer;
mod renderer;
mod text;

//! Estimators against each other, and their texts.

mod agreement;
mod text;

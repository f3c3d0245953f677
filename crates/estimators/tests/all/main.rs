//! Estimators against each other, and their texts.

mod agreement;
mod closure;
mod cylinders;
mod dense;
mod directions;
mod environments;
mod linear_lights;
mod methods;
mod nasty;
mod penumbrae;
mod round;
mod sides;
mod skies;
mod standing;
mod text;
mod values;

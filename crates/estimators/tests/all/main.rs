//! Tests of the estimators: they are compared with each other and with quadrature, and their texts
//! are parsed and printed.

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

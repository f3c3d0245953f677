//! Closed forms against quadrature, references, and each other.

// What the workshop's table of accuracy and its comparison with vectors take as well.
#[allow(
    dead_code,
    reason = "what the workshop writes of a row is not tested here"
)]
mod accuracy;
mod lobe_oracle;
mod lobe_rows;
mod naive;
mod oracle;
mod polygon_oracle;
mod reference;
mod solid_rows;

mod accuracy_page;
mod elliptic_cones;
mod exponent_zero;
mod found;
mod hostile;
mod laws;
mod lines_by_quadrature;
mod lobe_tolerance;
mod next_to_the_point;
mod polygons_by_quadrature;
mod vectors;

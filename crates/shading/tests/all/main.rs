//! These tests compare closed forms with quadrature, with references, and with each other.

mod accuracy;
mod lobe_oracle;
mod lobe_rows;
mod naive;
mod oracle;
mod polygon_oracle;
mod reference;
mod solid_rows;

mod accuracy_page;
mod accuracy_report;
mod accuracy_table;
mod elliptic_cones;
mod exponent_zero;
mod found;
mod hostile;
mod laws;
mod lines_by_quadrature;
mod next_to_the_point;
mod polygons_by_quadrature;
mod vectors;

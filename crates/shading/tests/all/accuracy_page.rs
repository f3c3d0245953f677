//! These tests repeat a part of the inputs behind `docs/accuracy.md`: no row may be worse than its
//! table says.

use crate::accuracy::{self, Row};
use crate::{lobe_rows, solid_rows};
use linelit_testkit::public::page;

/// The first inputs of each row: no more than the table's worst (which is of more of the same
/// inputs).
fn hold(rows: &[Row]) {
    let Some(table) = page(env!("CARGO_MANIFEST_DIR"), "docs/accuracy.md") else {
        return;
    };
    let worse = accuracy::regressions(rows, &table);
    assert!(worse.is_empty(), "{}", worse.join("\n"));
}

#[test]
fn lines_are_as_accurate_as_the_table_says() {
    hold(&accuracy::lines(4000));
}

#[test]
fn polygons_are_as_accurate_as_the_table_says() {
    hold(&accuracy::polygons(3000));
}

#[test]
fn lobes_along_lines_are_as_accurate_as_the_table_says() {
    hold(&lobe_rows::phong_lines(2000));
    hold(&lobe_rows::gaussians(1500));
    hold(&lobe_rows::quadratures(500));
}

#[test]
fn solid_angles_and_ltc_are_as_accurate_as_the_table_says() {
    hold(&solid_rows::solid_angles(3000));
    hold(&solid_rows::ltc(1500));
}

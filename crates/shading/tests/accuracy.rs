//! A part of the inputs behind `docs/accuracy.md`: no row may be worse than its table says.

#[path = "common/accuracy.rs"]
#[allow(dead_code, reason = "the plots of the example read more of a sample")]
mod accuracy;
#[path = "common/naive.rs"]
mod naive;
#[path = "common/oracle.rs"]
mod oracle;

#[test]
fn no_row_of_the_accuracy_table_is_worse() {
    let table = include_str!("../../../docs/accuracy.md");
    let mut rows = accuracy::lines(4000);
    rows.extend(accuracy::polygons(3000));
    rows.extend(accuracy::lobes(150));
    let worse = accuracy::regressions(&rows, table);
    assert!(worse.is_empty(), "{}", worse.join("\n"));
}

//! A renderer of one's own: its own BSDF, lights and triangles, no scene and no files.
//!
//! What the same room is in a scene file, `crates/integrator/tests/own_renderer.rs` holds to this.

#[path = "common/own_renderer.rs"]
mod own_renderer;

use linelit_geometry::DVec3;
use own_renderer::{Room, radiance};

/// Every estimator gives the light of many samples of another, though the BSDF has no closed form:
/// 4,096 stratified samples of either are good to 1e-3 of the unshadowed light; five times that.
#[test]
fn estimators_agree_without_closed_forms() {
    let room = Room::new();
    for x in [DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.6, -0.2, 0.0)] {
        let want = radiance(&room, x, "point-solid-angle+point-bsdf", 4096);
        assert!(want.min_element() > 0.01, "{want}");
        for estimator in [
            "point-area",
            "line-area",
            "exact",
            "hybrid",
            "line-solid-angle+point-bsdf",
        ] {
            let got = radiance(&room, x, estimator, 4096);
            let error = (got - want).abs().max_element() / want.max_element();
            assert!(error < 5e-3, "{estimator}: {got} for {want}");
        }
    }
}

//! The small scenes on which claims of the papers are measured.

use crate::{Files, luminaires};

/// A diffuse floor under a light.
const BARE: &str = include_str!("papers/bare.pbrt");
/// A screen with one slanted edge halfway between the floor and the light.
const SCREEN: &str = include_str!("papers/screen.pbrt");
/// A second light, which is hidden by a ceiling.
const HIDDEN: &str = include_str!("papers/hidden.pbrt");
/// A linear light that goes through the horizon.
const HORIZON: &str = include_str!("papers/horizon.pbrt");
/// A floor with Frostbite's standard material, under a long linear light.
const FLOOR: &str = include_str!("papers/floor.pbrt");

/// Returns a scene of one file.
fn file(name: &str, text: impl Into<String>) -> Files {
    vec![(format!("{name}.pbrt"), text.into().into_bytes())]
}

/// Returns the files of a scene: a diffuse floor under a light.
pub(crate) fn bare() -> Files {
    file("bare", BARE)
}

/// Returns the files of a scene: the floor with a screen below the light.
pub(crate) fn screened() -> Files {
    file("screened", [BARE, SCREEN].concat())
}

/// Returns the files of a scene: the floor with a second light that is hidden.
pub(crate) fn hidden() -> Files {
    file("hidden", [BARE, HIDDEN].concat())
}

/// Returns the files of a scene: a floor under a linear light that goes through its horizon.
pub(crate) fn horizon() -> Files {
    file("horizon", HORIZON)
}

/// Returns the files of a scene: a glossy floor under a linear light.
pub(crate) fn wet() -> Files {
    file("wet", FLOOR.replace("ROUGHNESS", "0.22"))
}

/// Returns the files of a scene: a rough floor under a linear light.
pub(crate) fn dry() -> Files {
    file("dry", FLOOR.replace("ROUGHNESS", "0.6"))
}

/// Returns the files of a scene: the room with 2 luminaires.
pub(crate) fn luminaires_2() -> Files {
    file("luminaires-2", luminaires::room(2))
}

/// Returns the files of a scene: the room with 32 luminaires.
pub(crate) fn luminaires_32() -> Files {
    file("luminaires-32", luminaires::room(32))
}

/// Returns the files of a scene: a floor next to a spherical light.
pub(crate) fn shining_ball() -> Files {
    file("shining-ball", luminaires::shining_ball())
}

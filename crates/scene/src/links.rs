//! Light linking: which lights illuminate a mesh, and which of them it hides.

/// Which sets of lights a mesh has to do with; bit k stands for set k.
///
/// Every light is in one set ([`crate::EmissionSpec::set`]); set 0 holds those that are not said
/// to be in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Links {
    /// The sets whose lights illuminate the mesh.
    pub lit_by: u32,
    /// The sets whose lights the mesh hides: it casts shadows of these. Views it hides always.
    pub shadows: u32,
}

impl Links {
    /// The most sets that a scene may have.
    pub const MAX_SETS: usize = 31;

    /// All sets.
    pub const ALL: u32 = (1 << Self::MAX_SETS) - 1;
}

impl Default for Links {
    /// All sets.
    fn default() -> Self {
        Self {
            lit_by: Self::ALL,
            shadows: Self::ALL,
        }
    }
}

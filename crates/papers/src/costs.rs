//! What named studies cost.

/// Processor seconds of studies, for a word of warning: user and system time of `converge STUDY`,
/// built with `--release`, on two of the cores of an AMD EPYC of 2026 that others used as well.
/// Those of [`PARTLY`] were stopped after half a minute or more; the rest of their units is by the
/// plan's guesses, times what the guesses of units of that kind were wrong by.
const MEASURED: [(&str, f64); 21] = [
    ("default", 107.0),
    ("claims", 194.0),
    ("billen-orders", 183.0),
    ("billen-table1", 4.0),
    ("billen-figures", 17.7),
    ("billen-growth", 9.7),
    ("billen-origin", 9.0),
    ("billen-time", 27.0),
    ("peters-fig1", 8.7),
    ("peters-fig3", 1.6),
    ("peters-fig4", 0.7),
    ("peters-fig6", 3.2),
    ("peters-fig7", 6.5),
    ("peters-table1", 2.1),
    ("salesin-fig3", 17.2),
    ("salesin-fig4", 0.2),
    ("salesin-fig5", 11.1),
    ("salesin-fig7-gain", 25.3),
    ("salesin-fig8", 52.0),
    ("salesin-rays", 20.4),
    ("shirley", 118.0),
];

/// As [`MEASURED`], of studies of which a part was.
const PARTLY: [(&str, f64); 4] = [
    ("salesin-fig1", 160.0),
    ("salesin-fig6", 310.0),
    ("salesin-fig9", 97.0),
    ("salesin-fig10", 170.0),
];

/// Processor seconds that a named study took, all its threads together; of one that is given a
/// scene, with that of its own or, for want of one, `cornell-box-large`. `None` of a study that was
/// not measured.
#[must_use]
pub fn processor_seconds(study: &str) -> Option<f64> {
    let mut known = MEASURED.iter().chain(&PARTLY);
    let found = known.find(|(name, _)| *name == study);
    found.map(|(_, seconds)| *seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_those_of_studies() {
        let names: Vec<&str> = crate::studies().map(|(name, _)| name).collect();
        let known: Vec<&str> = MEASURED
            .iter()
            .chain(&PARTLY)
            .map(|(name, _)| *name)
            .collect();
        for (k, name) in known.iter().enumerate() {
            assert!(names.contains(name) && !known[..k].contains(name), "{name}");
        }
        assert_eq!(processor_seconds("peters-table1"), Some(2.1));
        assert_eq!(processor_seconds("no-study"), None);
    }
}

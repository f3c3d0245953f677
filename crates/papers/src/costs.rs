//! What named studies cost.

/// Processor seconds of studies, for a word of warning: user and system time of `converge STUDY`,
/// built with `--release`, on two of the cores of an AMD EPYC of 2026 that others used as well; of
/// `salesin-fig9`, on `strips`.
const MEASURED: [(&str, f64); 27] = [
    ("default", 107.0),
    ("claims", 194.0),
    ("billen-orders", 169.0),
    ("billen-table1", 3.9),
    ("billen-figures", 16.8),
    ("billen-growth", 5.1),
    ("billen-origin", 9.9),
    ("billen-time", 21.1),
    ("peters-fig1", 11.2),
    ("peters-fig3", 1.4),
    ("peters-fig4", 0.6),
    ("peters-fig6", 2.9),
    ("peters-fig7", 5.9),
    ("peters-table1", 4.1),
    ("salesin-fig1", 138.0),
    ("salesin-fig3", 15.3),
    ("salesin-fig4", 0.1),
    ("salesin-fig5", 10.5),
    ("salesin-fig6", 152.0),
    ("salesin-fig7", 26.6),
    ("salesin-fig7-gain", 21.1),
    ("salesin-fig8", 47.9),
    ("salesin-fig9", 90.0),
    ("salesin-fig10", 309.0),
    ("salesin-fig11", 414.0),
    ("salesin-rays", 20.2),
    ("shirley", 118.0),
];

/// Processor seconds that a named study took, all its threads together; of one that is given a
/// scene, with that of its own or, for want of one, `cornell-box-large`. `None` of a study that was
/// not measured.
#[must_use]
pub fn processor_seconds(study: &str) -> Option<f64> {
    let found = MEASURED.iter().find(|(name, _)| *name == study);
    found.map(|(_, seconds)| *seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_those_of_studies() {
        let names: Vec<&str> = crate::studies().map(|(name, _)| name).collect();
        let known: Vec<&str> = MEASURED.iter().map(|(name, _)| *name).collect();
        for (k, name) in known.iter().enumerate() {
            assert!(names.contains(name) && !known[..k].contains(name), "{name}");
        }
        assert!(names.iter().all(|name| known.contains(name)), "{names:?}");
        assert_eq!(processor_seconds("peters-table1"), Some(4.1));
        assert_eq!(processor_seconds("no-study"), None);
    }
}

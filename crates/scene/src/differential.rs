//! Ray differentials at mirrors and glass: how the reflected and refracted directions change from
//! one pixel to the next (Igehy 1999, *Tracing ray differentials*).

use linelit_geometry::DVec3;

/// The change from one pixel to the next of the ray's direction (away from the viewer), and of the
/// unit normal on the viewer's side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    pub(crate) direction: DVec3,
    pub(crate) normal: DVec3,
}

impl Change {
    /// Returns the change, from one pixel to the next, of the reflected direction d − 2 (n·d) n,
    /// with d = −`outgoing`.
    pub(crate) fn reflected(&self, normal: DVec3, outgoing: DVec3) -> DVec3 {
        let cosine = -normal.dot(outgoing);
        self.direction - 2.0 * (self.of_cosine(normal, outgoing) * normal + cosine * self.normal)
    }

    /// Returns the change, from one pixel to the next, of the refracted direction d/η − (n·d/η + c)
    /// n. Here n is `normal`, d = −`outgoing`, `eta` is the relative index of refraction η, and
    /// `inner` is c, the cosine of the refracted direction behind the interface: c² = 1 − (1 −
    /// (n·d)²)/η².
    pub(crate) fn refracted(
        &self,
        normal: DVec3,
        outgoing: DVec3,
        [eta, inner]: [f64; 2],
    ) -> DVec3 {
        let cosine = -normal.dot(outgoing);
        let of_cosine = self.of_cosine(normal, outgoing);
        let of_inner = of_cosine * cosine / (eta * eta * inner);
        self.direction / eta
            - (of_cosine / eta + of_inner) * normal
            - (cosine / eta + inner) * self.normal
    }

    /// Returns the change, from one pixel to the next, of n·d, the cosine between the normal n and
    /// the ray's direction d = −`outgoing`.
    fn of_cosine(&self, normal: DVec3, outgoing: DVec3) -> f64 {
        self.direction.dot(normal) - outgoing.dot(self.normal)
    }
}

//! Double-double arithmetic of about 31 digits that the compiler can evaluate: it computes the
//! tables of `power`.

/// A number high + low, where the low part is at most half a unit in the last digit of the high
/// part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide {
    pub(crate) high: f64,
    pub(crate) low: f64,
}

impl Wide {
    const ONE: Self = Self::from(1.0);
    /// The natural logarithm of 2.
    pub(crate) const LN_2: Self = Self {
        high: std::f64::consts::LN_2,
        low: 2.319_046_813_846_299_6e-17,
    };

    const fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }

    /// Returns the sum a + b, exactly.
    const fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let shadow = high - a;
        let low = (a - (high - shadow)) + (b - shadow);
        Self { high, low }
    }

    /// Returns the product a · b, exactly, by splitting both factors into halves of 26 bits.
    const fn product(a: f64, b: f64) -> Self {
        const fn halves(a: f64) -> [f64; 2] {
            let scaled = 134_217_729.0 * a;
            let high = scaled - (scaled - a);
            [high, a - high]
        }
        let ([a1, a0], [b1, b0]) = (halves(a), halves(b));
        let high = a * b;
        let low = a0 * b0 - (((high - a1 * b1) - a0 * b1) - a1 * b0);
        Self { high, low }
    }

    const fn add(self, other: Self) -> Self {
        let sum = Self::sum(self.high, other.high);
        Self::sum(sum.high, sum.low + (self.low + other.low))
    }

    const fn mul(self, other: Self) -> Self {
        let product = Self::product(self.high, other.high);
        let low = self.high * other.low + self.low * other.high;
        Self::sum(product.high, product.low + low)
    }

    /// Returns the number times a factor that has few digits.
    pub(crate) const fn times(self, factor: f64) -> Self {
        self.mul(Self::from(factor))
    }

    /// Returns the number divided by a divisor.
    const fn over(self, divisor: f64) -> Self {
        let first = self.high / divisor;
        let rest = self.add(Self::product(-first, divisor));
        Self::sum(first, rest.high / divisor)
    }

    /// Returns the exponential of a number in [0, 1), by its Taylor series.
    pub(crate) const fn exp(self) -> Self {
        let (mut sum, mut k) = (Self::ONE, 30.0);
        while k >= 1.0 {
            // Horner's scheme: 1 + x/k (1 + x/(k + 1) (…)).
            sum = Self::ONE.add(self.mul(sum).over(k));
            k -= 1.0;
        }
        sum
    }

    /// Returns the natural logarithm of v in [0.7, 1.5], as 2 atanh((v − 1)/(v + 1)), where v − 1
    /// and v + 1 are exact.
    pub(crate) const fn ln(v: f64) -> Self {
        let q = Self::from(v - 1.0).over(v + 1.0);
        let square = q.mul(q);
        let (mut sum, mut k) = (Self::from(0.0), 24.0);
        while k >= 0.0 {
            sum = Self::ONE.over(2.0 * k + 1.0).add(square.mul(sum));
            k -= 1.0;
        }
        q.mul(sum).times(2.0)
    }

    /// Returns the multiple of 2⁻⁴² that is nearest to a number below 2⁹. Such multiples can be
    /// added, and multiplied by integers, without rounding.
    pub(crate) const fn in_few_digits(self) -> f64 {
        // The last digit of 1.5·2¹⁰ is 2⁻⁴², so adding and subtracting it rounds to that.
        const SHIFT: f64 = 1536.0;
        (self.high + SHIFT) - SHIFT
    }

    /// Returns the number minus `digits`, its first digits as [`Self::in_few_digits`] returns them.
    pub(crate) const fn without(self, digits: f64) -> f64 {
        let rest = Self::sum(self.high, -digits);
        rest.high + (rest.low + self.low)
    }
}

//! How long a finger's way is looked for: iterations of RRT-Connect that adapt to the scene.
//!
//! How many a way needs is not known: over a sphere hardly any, round a plate hundreds. The universal sequence of Luby,
//! Sinclair and Zuckerman 1993 (doi:10.1016/0020-0190(93)90029-9), 1, 1, 2, 1, 1, 2, 4, ..., spends equal shares on all
//! lengths up to the longest, and so at most a logarithmic factor more than who knows.

/// Iterations that the shortest look takes.
const SHORTEST: usize = 12;
/// The longest look is so many times the shortest.
const MOST: usize = 128;

/// The looks taken so far.
#[derive(Debug, Clone, Default)]
pub struct Patience {
    n_looks: u64,
}

impl Patience {
    /// Iterations of the next look.
    pub fn iterations(&self) -> usize {
        SHORTEST * luby(self.n_looks + 1).min(MOST as u64) as usize
    }

    /// A look has been taken.
    pub fn look_taken(&mut self) {
        self.n_looks += 1;
    }
}

/// Element `k`, from 1, of the universal sequence.
fn luby(mut k: u64) -> u64 {
    loop {
        let block = (k + 1).next_power_of_two();
        if block == k + 1 {
            return block / 2;
        }
        // A block of 2^n - 1 elements is two of half its length, and 2^(n-1).
        k -= block / 2 - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_that_of_luby() {
        let first: Vec<u64> = (1..=15).map(luby).collect();
        assert_eq!(first, [1, 1, 2, 1, 1, 2, 4, 1, 1, 2, 1, 1, 2, 4, 8]);
        let total = |length: u64| (1..=511).map(luby).filter(|&look| look == length).sum::<u64>();
        assert_eq!([total(1), total(16), total(256)], [256; 3]);
    }

    #[test]
    fn looks_get_as_long_as_allowed_and_no_longer() {
        let mut patience = Patience::default();
        let mut longest = 0;
        for _ in 0..1000 {
            longest = longest.max(patience.iterations());
            patience.look_taken();
        }
        assert_eq!(longest, SHORTEST * MOST);
    }
}

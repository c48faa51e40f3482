//! A square world of free and blocked unit cells, with flood fill as the second way of knowing. For tests.

use crate::space::Space;
use regrasp_base::Rng;

pub struct Toy {
    n: usize,
    blocked: Vec<bool>,
}

impl Toy {
    pub fn new(n: usize, blocked_cells: &[(usize, usize)]) -> Self {
        let mut blocked = vec![false; n * n];
        for &(x, y) in blocked_cells {
            blocked[y * n + x] = true;
        }
        Toy { n, blocked }
    }

    pub fn random(n: usize, share: f64, rng: &mut Rng) -> Self {
        Toy { n, blocked: (0..n * n).map(|_| rng.chance(share)).collect() }
    }

    pub fn size(&self) -> f64 {
        self.n as f64
    }

    pub fn is_free(&self, p: &[f64]) -> bool {
        let inside = p.iter().all(|&v| v >= 0.0 && v < self.size());
        inside && !self.blocked[p[1] as usize * self.n + p[0] as usize]
    }

    pub fn free_point(&self, rng: &mut Rng) -> Vec<f64> {
        loop {
            let p = vec![rng.uniform(0.0, self.size()), rng.uniform(0.0, self.size())];
            if self.is_free(&p) {
                return p;
            }
        }
    }

    /// True when the segment meets no blocked cell: exact, by clipping against each.
    pub fn sees(&self, a: &[f64], b: &[f64]) -> bool {
        if !self.is_free(a) || !self.is_free(b) {
            return false;
        }
        (0..self.n * self.n).filter(|&cell| self.blocked[cell]).all(|cell| {
            let low = [(cell % self.n) as f64, (cell / self.n) as f64];
            let (mut enter, mut leave): (f64, f64) = (0.0, 1.0);
            for k in 0..2 {
                let d = b[k] - a[k];
                if d == 0.0 {
                    if a[k] < low[k] || a[k] > low[k] + 1.0 {
                        return true;
                    }
                } else {
                    let (t0, t1) = ((low[k] - a[k]) / d, (low[k] + 1.0 - a[k]) / d);
                    (enter, leave) = (enter.max(t0.min(t1)), leave.min(t0.max(t1)));
                }
            }
            enter > leave
        })
    }

    /// Component of each cell by flood fill over sides; blocked cells have none.
    pub fn flood(&self) -> Vec<Option<usize>> {
        let mut colour = vec![None; self.n * self.n];
        for start in 0..self.n * self.n {
            if self.blocked[start] || colour[start].is_some() {
                continue;
            }
            let mut stack = vec![start];
            while let Some(cell) = stack.pop() {
                if self.blocked[cell] || colour[cell].is_some() {
                    continue;
                }
                colour[cell] = Some(start);
                let (x, y) = (cell % self.n, cell / self.n);
                if x > 0 {
                    stack.push(cell - 1);
                }
                if x + 1 < self.n {
                    stack.push(cell + 1);
                }
                if y > 0 {
                    stack.push(cell - self.n);
                }
                if y + 1 < self.n {
                    stack.push(cell + self.n);
                }
            }
        }
        colour
    }

    pub fn cell(&self, p: &[f64]) -> usize {
        p[1] as usize * self.n + p[0] as usize
    }
}

impl Space for Toy {
    type Point = Vec<f64>;
    type Motion = f64;

    fn sample(&mut self, rng: &mut Rng) -> Option<Vec<f64>> {
        let p = vec![rng.uniform(0.0, self.size()), rng.uniform(0.0, self.size())];
        self.is_free(&p).then_some(p)
    }

    fn distance(&self, a: &Vec<f64>, b: &Vec<f64>) -> f64 {
        (a[0] - b[0]).hypot(a[1] - b[1])
    }

    fn connect(&mut self, a: &Vec<f64>, b: &Vec<f64>) -> Option<f64> {
        self.sees(a, b).then(|| self.distance(a, b))
    }
}

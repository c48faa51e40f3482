//! Small dense linear programs: the simplex method (Dantzig 1951) in two phases.
//!
//! Made for contact forces: some ten to twenty columns over seven rows, solved some hundred thousand times a second. Columns
//! enter by the steepest reduced cost; after many pivots without progress by Bland's rule (1977), which never cycles.

use arrayvec::ArrayVec;

/// Most rows of a program.
pub const MAX_ROWS: usize = 12;
/// Most columns of a program.
pub const MAX_COLUMNS: usize = 36;

/// Reduced costs, pivots and right-hand sides below this count as zero, with rows of size one.
const SMALLEST: f64 = 1e-10;
/// What is left of the first phase that still counts as feasible.
const FEASIBLE: f64 = 1e-9;
/// What a solution may leave of the equations, with the largest unknown of size one.
const EXACT: f64 = 1e-9;
/// Pivots by the steepest rule; then Bland's takes over.
const STEEPEST: usize = 60;
/// Pivots after which there is no answer: rounding goes in circles.
const MOST_PIVOTS: usize = 400;

/// Minimise `cost . x` subject to `rows x = right`, `x >= 0`.
#[derive(Debug, Clone, Default)]
pub struct LinearProgram {
    /// Columns of the equations, each as long as there are rows.
    columns: ArrayVec<[f64; MAX_ROWS], MAX_COLUMNS>,
    cost: ArrayVec<f64, MAX_COLUMNS>,
    right: [f64; MAX_ROWS],
    n_rows: usize,
}

/// Why there is no solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSolution {
    /// No `x >= 0` fulfils the equations.
    Infeasible,
    /// The cost falls without end.
    Unbounded,
    /// Rounding does not let the method end.
    Circles,
    /// The method ended, but rounding has led it off the equations.
    Inexact,
}

impl LinearProgram {
    /// A program without columns. Panics with more than [`MAX_ROWS`] rows.
    pub fn new(right: &[f64]) -> Self {
        assert!(right.len() <= MAX_ROWS, "a linear program of more than {MAX_ROWS} rows");
        let mut program = LinearProgram { n_rows: right.len(), ..LinearProgram::default() };
        program.right[..right.len()].copy_from_slice(right);
        program
    }

    /// Adds a column with its cost; its index. Panics with more than [`MAX_COLUMNS`].
    pub fn add(&mut self, column: [f64; MAX_ROWS], cost: f64) -> usize {
        self.columns.push(column);
        self.cost.push(cost);
        self.columns.len() - 1
    }

    /// The least `x`.
    pub fn solve(&self) -> Result<ArrayVec<f64, MAX_COLUMNS>, NoSolution> {
        let mut tableau = Tableau::new(self);
        tableau.phase_one()?;
        tableau.phase_two(&self.cost)?;
        let mut x: ArrayVec<f64, MAX_COLUMNS> = self.columns.iter().map(|_| 0.0).collect();
        for row in 0..self.n_rows {
            if let Some(value) = x.get_mut(tableau.basis[row]) {
                *value = tableau.right[row].max(0.0);
            }
        }
        if self.is_solved_by(&x) { Ok(x) } else { Err(NoSolution::Inexact) }
    }

    /// True where `x` fulfils the equations: pivots near zero lose digits.
    fn is_solved_by(&self, x: &[f64]) -> bool {
        let size = x.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        (0..self.n_rows).all(|row| {
            let sum: f64 = x.iter().zip(&self.columns).map(|(x, column)| x * column[row]).sum();
            (sum - self.right[row]).abs() <= EXACT * size
        })
    }
}

/// Rows scaled to size one, with a basis. Columns from `n_columns` on are artificial and not stored.
struct Tableau {
    rows: [[f64; MAX_COLUMNS]; MAX_ROWS],
    right: [f64; MAX_ROWS],
    basis: [usize; MAX_ROWS],
    n_rows: usize,
    n_columns: usize,
}

impl Tableau {
    fn new(program: &LinearProgram) -> Self {
        let (n_rows, n_columns) = (program.n_rows, program.columns.len());
        let mut tableau = Tableau {
            rows: [[0.0; MAX_COLUMNS]; MAX_ROWS],
            right: [0.0; MAX_ROWS],
            basis: [0; MAX_ROWS],
            n_rows,
            n_columns,
        };
        for row in 0..n_rows {
            let size = program.columns.iter().map(|column| column[row].abs()).fold(0.0, f64::max);
            let scale = if size > 0.0 { 1.0 / size } else { 1.0 } * 1f64.copysign(program.right[row]);
            for (entry, column) in tableau.rows[row].iter_mut().zip(&program.columns) {
                *entry = scale * column[row];
            }
            tableau.right[row] = scale * program.right[row];
            tableau.basis[row] = n_columns + row;
        }
        tableau
    }

    /// Drives the artificial columns out of the basis.
    fn phase_one(&mut self) -> Result<(), NoSolution> {
        let scale = self.right[..self.n_rows].iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        let mut reduced = [0.0; MAX_COLUMNS];
        let mut left = 0.0;
        for row in 0..self.n_rows {
            left += self.right[row];
            for (cost, entry) in reduced.iter_mut().zip(&self.rows[row]) {
                *cost -= entry;
            }
        }
        self.descend(&mut reduced, &mut left)?;
        let is_left = |row: usize| self.basis[row] >= self.n_columns;
        let left: f64 = (0..self.n_rows).filter(|&row| is_left(row)).map(|row| self.right[row]).sum();
        if left > FEASIBLE * scale {
            return Err(NoSolution::Infeasible);
        }
        // An artificial column that stays at zero leaves by any pivot; where its row has none, the row says nothing.
        for row in 0..self.n_rows {
            if self.basis[row] < self.n_columns {
                continue;
            }
            let largest =
                (0..self.n_columns).max_by(|&a, &b| self.rows[row][a].abs().total_cmp(&self.rows[row][b].abs()));
            if let Some(column) = largest.filter(|&column| self.rows[row][column].abs() > SMALLEST) {
                self.right[row] = 0.0;
                self.pivot(row, column, &mut reduced, &mut 0.0);
            } else {
                self.rows[row] = [0.0; MAX_COLUMNS];
                self.right[row] = 0.0;
            }
        }
        Ok(())
    }

    fn phase_two(&mut self, cost: &[f64]) -> Result<(), NoSolution> {
        let mut reduced = [0.0; MAX_COLUMNS];
        reduced[..cost.len()].copy_from_slice(cost);
        let mut value = 0.0;
        for row in 0..self.n_rows {
            let Some(&of_basis) = cost.get(self.basis[row]) else { continue };
            value += of_basis * self.right[row];
            for (cost, entry) in reduced.iter_mut().zip(&self.rows[row]) {
                *cost -= of_basis * entry;
            }
        }
        self.descend(&mut reduced, &mut value)
    }

    /// Pivots until no reduced cost is below zero.
    fn descend(&mut self, reduced: &mut [f64; MAX_COLUMNS], value: &mut f64) -> Result<(), NoSolution> {
        let size = reduced[..self.n_columns].iter().fold(0.0, |a: f64, b| a.max(b.abs())).max(1e-300);
        for n_pivots in 0..MOST_PIVOTS {
            let gains = |column: &usize| reduced[*column] < -SMALLEST * size;
            let entering = match n_pivots < STEEPEST {
                true => (0..self.n_columns).filter(gains).min_by(|&a, &b| reduced[a].total_cmp(&reduced[b])),
                false => (0..self.n_columns).find(gains),
            };
            let Some(column) = entering else { return Ok(()) };
            let mut leaving: Option<(f64, usize)> = None;
            for row in 0..self.n_rows {
                let entry = self.rows[row][column];
                if entry > SMALLEST {
                    let ratio = self.right[row].max(0.0) / entry;
                    let is_first = leaving.is_none_or(|(least, other)| {
                        ratio < least || (ratio == least && self.basis[row] < self.basis[other])
                    });
                    if is_first {
                        leaving = Some((ratio, row));
                    }
                }
            }
            let Some((_, row)) = leaving else { return Err(NoSolution::Unbounded) };
            self.pivot(row, column, reduced, value);
        }
        Err(NoSolution::Circles)
    }

    fn pivot(&mut self, row: usize, column: usize, reduced: &mut [f64; MAX_COLUMNS], value: &mut f64) {
        let n = self.n_columns;
        let inverse = 1.0 / self.rows[row][column];
        self.rows[row][..n].iter_mut().for_each(|entry| *entry *= inverse);
        self.right[row] *= inverse;
        let (pivot_row, pivot_right) = (self.rows[row], self.right[row]);
        for other in (0..self.n_rows).filter(|&other| other != row) {
            let factor = self.rows[other][column];
            if factor != 0.0 {
                self.rows[other][..n].iter_mut().zip(&pivot_row).for_each(|(entry, pivot)| *entry -= factor * pivot);
                self.right[other] -= factor * pivot_right;
            }
        }
        let factor = reduced[column];
        reduced[..n].iter_mut().zip(&pivot_row).for_each(|(entry, pivot)| *entry -= factor * pivot);
        *value += factor * pivot_right;
        self.basis[row] = column;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use regrasp_base::Rng;

    /// The least cost over all bases, by solving the equations for each.
    fn by_enumeration(program: &LinearProgram) -> Option<f64> {
        let (m, n) = (program.n_rows, program.columns.len());
        let mut best: Option<f64> = None;
        for chosen in (0u32..1 << n).filter(|set| set.count_ones() as usize == m) {
            let columns: Vec<usize> = (0..n).filter(|k| chosen & (1 << k) != 0).collect();
            let matrix = DMatrix::from_fn(m, m, |row, k| program.columns[columns[k]][row]);
            let right = DVector::from_fn(m, |row, _| program.right[row]);
            let Some(x) = matrix.lu().solve(&right) else { continue };
            if x.iter().all(|value| *value > -1e-9) {
                let cost = columns.iter().zip(x.iter()).map(|(&k, value)| program.cost[k] * value).sum();
                best = Some(best.map_or(cost, |least: f64| least.min(cost)));
            }
        }
        best
    }

    #[test]
    fn the_least_cost_is_that_of_the_best_basis() {
        let mut rng = Rng::keyed(1, "linear_program", 0);
        let (mut n_feasible, mut n_infeasible) = (0, 0);
        for _ in 0..400 {
            let (m, n) = (2 + rng.below(3), 5 + rng.below(5));
            let right: Vec<f64> = (0..m).map(|_| rng.uniform(-1.0, 1.0)).collect();
            let mut program = LinearProgram::new(&right);
            for _ in 0..n {
                let mut column = [0.0; MAX_ROWS];
                column[..m].iter_mut().for_each(|entry| *entry = rng.uniform(-1.0, 1.0));
                // Costs above zero: never unbounded.
                program.add(column, rng.uniform(0.1, 1.0));
            }
            match (program.solve(), by_enumeration(&program)) {
                (Ok(x), Some(least)) => {
                    n_feasible += 1;
                    let cost: f64 = x.iter().zip(&program.cost).map(|(x, cost)| x * cost).sum();
                    assert!((cost - least).abs() < 1e-7 * (1.0 + least.abs()), "{cost} {least}");
                    for row in 0..m {
                        let sum: f64 = x.iter().zip(&program.columns).map(|(x, column)| x * column[row]).sum();
                        assert!((sum - right[row]).abs() < 1e-9);
                    }
                    assert!(x.iter().all(|x| *x >= 0.0));
                }
                (Err(NoSolution::Infeasible), None) => n_infeasible += 1,
                (found, wanted) => panic!("{found:?} {wanted:?}"),
            }
        }
        assert!(n_feasible > 50 && n_infeasible > 50, "{n_feasible} {n_infeasible}");
    }

    /// Nearly parallel columns: a pivot near zero, after which the equations would be off by more than the unknowns' rounding.
    #[test]
    fn a_solution_fulfils_the_equations_or_there_is_none() {
        let mut rng = Rng::keyed(2, "linear_program", 0);
        let mut n_solved = 0;
        for _ in 0..2000 {
            let m = 4;
            let mut columns = Vec::new();
            for k in 0..8 {
                let mut column = if k % 2 == 0 { [0.0; MAX_ROWS] } else { columns[k - 1] };
                let size = if k % 2 == 0 { 1.0 } else { 10f64.powf(rng.uniform(-10.0, -8.0)) };
                column[..m].iter_mut().for_each(|entry: &mut f64| *entry += size * rng.uniform(-1.0, 1.0));
                columns.push(column);
            }
            let mut right = [0.0; 4];
            for column in &columns {
                let share = rng.uniform(0.0, 1.0);
                right.iter_mut().zip(column).for_each(|(sum, entry)| *sum += share * entry);
            }
            let mut program = LinearProgram::new(&right);
            columns.into_iter().for_each(|column| _ = program.add(column, rng.uniform(0.1, 1.0)));
            match program.solve() {
                Ok(x) => {
                    n_solved += 1;
                    let size = x.iter().fold(1.0, |a: f64, b| a.max(*b));
                    for row in 0..m {
                        let sum: f64 = x.iter().zip(&program.columns).map(|(x, column)| x * column[row]).sum();
                        assert!((sum - right[row]).abs() <= 1e-9 * size);
                    }
                    let off: Vec<f64> = x.iter().map(|x| x + 1e-8 * size).collect();
                    assert!(!program.is_solved_by(&off));
                }
                Err(why) => assert_eq!(why, NoSolution::Inexact),
            }
        }
        assert!(n_solved > 1900, "{n_solved}");
    }

    fn column(first: f64, second: f64) -> [f64; MAX_ROWS] {
        let mut column = [0.0; MAX_ROWS];
        column[..2].copy_from_slice(&[first, second]);
        column
    }

    #[test]
    fn costs_without_end_and_rows_that_say_nothing() {
        let mut program = LinearProgram::new(&[1.0]);
        program.add(column(1.0, 0.0), 0.0);
        program.add(column(-1.0, 0.0), -1.0);
        assert_eq!(program.solve(), Err(NoSolution::Unbounded));
        let mut program = LinearProgram::new(&[1.0, 2.0, 0.0]);
        program.add(column(1.0, 2.0), 3.0);
        program.add(column(2.0, 4.0), 1.0);
        assert_eq!(program.solve().unwrap().as_slice(), [0.0, 0.5]);
    }
}

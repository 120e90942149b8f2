//! Loops over chunks of rows, by the threads of the current pool with the feature `rayon`. Results
//! do not depend on the number of threads.

/// How rows are divided among threads.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "rayon"), allow(dead_code))]
pub(crate) struct Tasks {
    /// Number of rows of one task.
    pub(crate) rows: usize,
    /// Fewer rows are one task, on the calling thread.
    pub(crate) min_rows: usize,
}

impl Tasks {
    /// Calls `work` with chunks of rows and the index of the first row of each.
    pub(crate) fn for_each<T: Send>(self, rows: &mut [T], work: impl Fn(usize, &mut [T]) + Sync) {
        #[cfg(feature = "rayon")]
        if rows.len() >= self.min_rows {
            use rayon::iter::{IndexedParallelIterator, ParallelIterator};
            use rayon::slice::ParallelSliceMut;
            let tasks = rows.par_chunks_mut(self.rows).enumerate();
            return tasks.for_each(|(task, rows)| work(task * self.rows, rows));
        }
        work(0, rows);
    }

    /// Returns true if `test` does for all chunks of rows.
    pub(crate) fn all<T: Sync>(self, rows: &[T], test: impl Fn(&[T]) -> bool + Sync + Send) -> bool {
        #[cfg(feature = "rayon")]
        if rows.len() >= self.min_rows {
            use rayon::iter::ParallelIterator;
            use rayon::slice::ParallelSlice;
            return rows.par_chunks(self.rows).all(test);
        }
        test(rows)
    }
}

/// The results of `work` for each item.
pub(crate) fn map<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "rayon")]
    if items.len() > 1 {
        use rayon::iter::{IntoParallelIterator, ParallelIterator};
        return items.into_par_iter().map(work).collect();
    }
    items.into_iter().map(work).collect()
}

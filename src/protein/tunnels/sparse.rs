//! Values for cells, of which few are ever asked about.

/// Values of a page.
const PAGE: usize = 512;

/// A value for each of many cells: room is made where one is set, and elsewhere all are the same.
#[derive(Debug, Clone)]
pub struct Sparse<T> {
    pages: Vec<Option<Box<[T; PAGE]>>>,
    elsewhere: T,
}

impl<T: Copy> Sparse<T> {
    /// For `count` cells.
    pub fn new(count: usize, elsewhere: T) -> Self {
        Sparse {
            pages: vec![None; count.div_ceil(PAGE)],
            elsewhere,
        }
    }

    /// The value of a cell.
    #[inline]
    pub fn get(&self, cell: u32) -> T {
        let page = &self.pages[cell as usize / PAGE];
        page.as_ref()
            .map_or(self.elsewhere, |page| page[cell as usize % PAGE])
    }

    /// The value of a cell, to be changed.
    #[inline]
    pub fn at(&mut self, cell: u32) -> &mut T {
        let page = &mut self.pages[cell as usize / PAGE];
        let page = page.get_or_insert_with(|| Box::new([self.elsewhere; PAGE]));
        &mut page[cell as usize % PAGE]
    }

    /// Bytes of the values that there is room for.
    pub fn bytes(&self) -> u64 {
        (self.pages.iter().flatten().count() * size_of::<[T; PAGE]>()) as u64
    }

    /// The cells whose value fits, in order.
    pub fn find(&self, fits: impl Fn(&T) -> bool) -> impl Iterator<Item = u32> {
        let pages = self.pages.iter().enumerate();
        let cells = pages.filter_map(|(at, page)| page.as_ref().map(|page| (at, page)));
        cells.flat_map(move |(at, page)| {
            let within: Vec<u32> = (0..PAGE)
                .filter(|k| fits(&page[*k]))
                .map(|k| (at * PAGE + k) as u32)
                .collect();
            within
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_set_is_there_and_takes_its_room_alone() {
        let mut values = Sparse::new(10_000, 7u8);
        assert_eq!((values.get(9_999), values.bytes()), (7, 0));
        *values.at(9_999) = 1;
        *values.at(3) = 2;
        assert_eq!([3, 4, 5_000, 9_999].map(|k| values.get(k)), [2, 7, 7, 1]);
        assert_eq!(values.bytes(), 2 * PAGE as u64);
        assert_eq!(values.find(|v| *v < 7).collect::<Vec<_>>(), [3, 9_999]);
    }
}

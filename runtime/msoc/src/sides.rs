//! The pixels on one side of a row or column of a tile, as its lanes hold them.

/// Pixels of subtiles that are on one side of a row or column, which is among them.
pub(crate) struct Sides<From, UpTo> {
    /// In a tile, from each on.
    pub from: From,
    /// In two tiles, up to each.
    pub up_to: UpTo,
}

/// Rows of tiles of 16 lanes. For tiles of 8 the first half of rows and lanes is the same: one tile of `from`, two of `up_to`.
pub(crate) const ROWS: &Sides<[[u32; 16]; 16], [[u32; 32]; 32]> = &{
    let mut sides = Sides {
        from: [[0; 16]; 16],
        up_to: [[0; 32]; 32],
    };
    let mut at = 0;
    while at < 32 * 32 {
        let (row, lane) = (at / 32, at % 32);
        let first_row = lane & !3;
        if row < 16 && lane < 16 {
            sides.from[row][lane] = pixels_of(0xFF, (!0 << row) >> first_row);
        }
        sides.up_to[row][lane] = pixels_of(0xFF, (!0 >> (31 - row)) >> first_row);
        at += 1;
    }
    sides
};

/// Columns; of two tiles, a row of subtiles in each.
pub(crate) const COLUMNS: &Sides<[[u32; 4]; 32], [[[u32; 4]; 2]; 64]> = &{
    let mut sides = Sides {
        from: [[0; 4]; 32],
        up_to: [[[0; 4]; 2]; 64],
    };
    let mut at = 0;
    while at < 64 * 8 {
        let (column, lane) = (at / 8, at % 8);
        if column < 32 && lane < 4 {
            sides.from[column][lane] = pixels_of((!0 << column) >> (8 * lane), 0xF);
        }
        let columns = (!0_u64 >> (63 - column)) >> (8 * lane);
        sides.up_to[column][lane / 4][lane % 4] = pixels_of(columns as u32, 0xF);
        at += 1;
    }
    sides
};

/// The pixels of a subtile in some of its eight columns and four rows.
const fn pixels_of(columns: u32, rows: u32) -> u32 {
    let mut pixels = 0;
    let mut row = 0;
    while row < 4 {
        if rows >> row & 1 == 1 {
            pixels |= (columns & 0xFF) << (8 * row);
        }
        row += 1;
    }
    pixels
}

//! What a table of the store is: its folder, its schema, and its rows as columns.

use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;

use super::columns::{Cells, Columns};
use super::entry::Content;

/// What tells a row from all others of its table.
pub type Key = [u8; 32];

/// A key's first half: of two keys of a store that are unlike no halves are alike, short of 2^64 rows.
pub fn short(key: &Key) -> u128 {
    key.first_chunk().map_or(0, |half| u128::from_be_bytes(*half))
}

/// A table.
pub trait Table {
    /// A row.
    type Row: Send + Sync;
    /// Folder in the store.
    const FOLDER: &'static str;
    /// Rows of a full row group.
    const FULL: usize;
    /// Columns, in the notation of Parquet.
    fn schema() -> String;
    /// The columns that a key is made of.
    const KEYS: &'static [&'static str];
    /// Keys of all rows, from those columns.
    ///
    /// # Errors
    /// Columns that hold something else.
    fn keys(columns: &Columns) -> Result<Vec<Key>, ParquetError>;
    /// A row's key.
    fn key(row: &Self::Row) -> Key;
    /// Bytes of a row in memory, about.
    fn bytes(row: &Self::Row) -> usize;
    /// Adds a row to columns.
    ///
    /// # Errors
    /// Columns of another table.
    fn put(row: &Self::Row, columns: &mut Columns) -> Result<(), ParquetError>;
    /// The rows, each for itself: one that is damaged leaves the others.
    ///
    /// # Errors
    /// Columns of another table.
    fn take(columns: &Columns) -> Result<Vec<Result<Self::Row, String>>, ParquetError>;
}

/// Text of a cell.
pub fn text(cell: &Cells<'_, ByteArray>) -> Option<String> {
    Some(String::from_utf8_lossy(cell.value()?.data()).into_owned())
}

/// A text as Parquet has it.
pub fn bytes(text: &str) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}

/// Contents of all rows in a column of digests.
///
/// # Errors
/// A column that holds something else.
pub fn contents(columns: &Columns, path: &str) -> Result<Vec<Content>, ParquetError> {
    let digest = |cell: Cells<'_, ByteArray>| {
        let content = text(&cell).and_then(|text| Content::parse(&text));
        content.ok_or_else(|| ParquetError::General(format!("a row of column {path} is no SHA-256")))
    };
    columns.rows::<ByteArray>(path)?.map(digest).collect()
}

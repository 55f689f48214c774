//! PDBx/mmCIF: the atoms of a data block.
//!
//! Read is the category `_atom_site`, whose columns stand in any order. Residues have the names and
//! numbers that the author gave them (`auth_`), as in PDB files, and those of `label_` where there are
//! none. Source: J. D. Westbrook et al., "PDBx/mmCIF Ecosystem", J. Mol. Biol. 434, 2022.

mod sites;
#[cfg(test)]
mod tests;
mod tokens;
mod write;

pub use write::write;

use super::gather::Gathered;
use super::refusal::Refusal;
use super::text::Lines;
use crate::error::Fault;
use crate::io::source::Source;
use crate::protein::Molecule;
use crate::report::{Tally, Warning};
use sites::{Columns, Row, Sites};
use tokens::{Token, Tokens};

/// Bytes of a row, as most files have them.
const ROW: usize = 90;

/// What the names of columns begin with.
const CATEGORY: &[u8] = b"_atom_site.";

/// Reads the atoms of the first data block that has any, in their order.
///
/// # Errors
///
/// With the line: a row that lacks values, a value that is no number or none that is finite, quotes and
/// blocks of text that do not end, coordinates that are no column, and a model that goes on after
/// another; and atoms that take more than the source may hold.
///
/// # Cost
///
/// Linear in the bytes.
pub fn read(source: &Source, warnings: &mut Vec<Warning>) -> Result<Molecule, Refusal> {
    let bytes = source.bytes();
    let mut reader = Reader {
        tokens: Tokens::new(bytes),
        sites: Sites::new(Gathered::new(bytes.len(), ROW, source.limit())),
        block: &[],
        is_read: false,
        single: Single::default(),
        further: Tally::default(),
        is_small: false,
    };
    reader.read_blocks()?;
    reader.further.warn(
        "further-atoms",
        "atoms of a further data block or table; not read",
        warnings,
    );
    if reader.sites.is_empty() && reader.is_small {
        let fault =
            Fault::whole("holds no atoms of a macromolecule, but those of a crystal's cell");
        let hint = "convert it to PDBx/mmCIF with the program that made it";
        return Err(fault.with_hint(hint).into());
    }
    Ok(reader.sites.finish(warnings))
}

/// Whether a text begins with a data block.
pub fn is_document(text: &[u8]) -> bool {
    let start = Lines::new(text).next_filled().unwrap_or_default();
    let word = start.get(..5).unwrap_or_default();
    word.eq_ignore_ascii_case(b"data_")
}

/// Values that stand beside their names rather than in a loop: those of a single atom.
#[derive(Default)]
struct Single<'a> {
    columns: Columns,
    values: Vec<Option<&'a [u8]>>,
    line: u64,
}

struct Reader<'a> {
    tokens: Tokens<'a>,
    sites: Sites,
    /// Name of the current block.
    block: &'a [u8],
    /// Whether there are atoms already.
    is_read: bool,
    single: Single<'a>,
    further: Tally,
    /// Whether there are atoms in the manner of small molecules.
    is_small: bool,
}

impl<'a> Reader<'a> {
    fn read_blocks(&mut self) -> Result<(), Refusal> {
        while let Some(token) = self.tokens.next()? {
            match token {
                Token::Block(name) => {
                    self.end_single()?;
                    self.block = name;
                }
                Token::Loop => self.read_loop()?,
                Token::Tag(tag) => {
                    let line = self.tokens.line();
                    let value = self.tokens.peek()?;
                    if let Some(Token::Value(value)) = value {
                        self.tokens.next()?;
                        if let Some(column) = in_category(tag) {
                            self.single.line = line;
                            self.single.columns.push(column);
                            self.single.values.push(value);
                        }
                    }
                    self.note(tag);
                }
                Token::Value(_) | Token::Other => {}
            }
        }
        self.end_single()
    }

    fn note(&mut self, tag: &[u8]) {
        let begins = |start: &[u8]| {
            tag.get(..start.len())
                .is_some_and(|head| head.eq_ignore_ascii_case(start))
        };
        self.is_small |= begins(b"_atom_site_fract_x");
        if begins(b"_entity_poly") {
            self.sites.trust_sequence();
        }
    }

    /// The atom whose values stand one by one, at the end of its block.
    fn end_single(&mut self) -> Result<(), Refusal> {
        let single = std::mem::take(&mut self.single);
        if single.values.is_empty() {
            return Ok(());
        }
        if self.is_read {
            self.further.note(single.line);
            return Ok(());
        }
        self.begin(&single.columns, single.line)?;
        self.sites
            .push(&single.columns.row(&single.values), single.line)
    }

    fn begin(&mut self, columns: &Columns, line: u64) -> Result<(), Fault> {
        columns.check(line)?;
        self.is_read = true;
        self.sites.set_id(self.block);
        Ok(())
    }

    fn read_loop(&mut self) -> Result<(), Refusal> {
        let mut columns = Columns::default();
        let mut is_ours = false;
        let line = self.tokens.line();
        while let Some(Token::Tag(tag)) = self.tokens.peek()? {
            self.tokens.next()?;
            let column = in_category(tag);
            is_ours |= column.is_some();
            columns.push(column.unwrap_or_default());
            self.note(tag);
        }
        if is_ours && !self.is_read {
            self.begin(&columns, line)?;
            return self.read_rows(&columns);
        }
        if is_ours {
            self.further.note(line);
        }
        while let Some(Token::Value(_)) = self.tokens.peek()? {
            self.tokens.next()?;
        }
        Ok(())
    }

    fn read_rows(&mut self, columns: &Columns) -> Result<(), Refusal> {
        let width = columns.len();
        let mut row = Row::default();
        let mut at = 0;
        let mut line = self.tokens.line();
        loop {
            let before = self.tokens.clone();
            let Some(Token::Value(value)) = self.tokens.next()? else {
                // The token after the rows is read once more.
                self.tokens = before;
                break;
            };
            if at == 0 {
                line = self.tokens.line();
            }
            columns.set(&mut row, at, value);
            at += 1;
            if at == width {
                self.sites.push(&row, line)?;
                at = 0;
            }
        }
        if at > 0 {
            let missing = width - at;
            let values = if missing == 1 { "value" } else { "values" };
            let problem = format!("the atom that begins here lacks {missing} {values} of {width}");
            return Err(Fault::line(line, problem).into());
        }
        Ok(())
    }
}

/// The name of a column of atoms, without its category.
fn in_category(tag: &[u8]) -> Option<&[u8]> {
    let (category, column) = tag.split_at_checked(CATEGORY.len())?;
    category.eq_ignore_ascii_case(CATEGORY).then_some(column)
}

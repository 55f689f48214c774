//! Bits with probabilities, written, read or only weighed by one and the same code.
//!
//! A model calls [`Coder::bit`] for each of its decisions and goes on with what comes back: the bit
//! itself where it is written or weighed, the bit of the stream where it is read. So there is one
//! description of every part of a stream, not two that must agree.

use crate::error::Fault;
use constriction::stream::model::{DecoderModel, EncoderModel, EntropyModel};
use constriction::stream::queue::{DefaultRangeDecoder, DefaultRangeEncoder};
use constriction::stream::{Decode, Encode};
use std::borrow::Borrow;
use std::num::NonZeroU32;
use std::sync::LazyLock;

/// Bits of a probability: those of a one stand in 2^16.
pub const PRECISION: usize = 16;
const WHOLE: u32 = 1 << PRECISION;

/// Takes bits in their order, or gives them.
pub trait Coder {
    /// One bit that is set with the probability `one / 2^16`, `0 < one < 2^16`; returns the bit that
    /// the stream holds.
    fn bit(&mut self, one: u32, bit: bool) -> bool;

    /// A bit of no known probability.
    fn plain(&mut self, bit: bool) -> bool {
        self.bit(WHOLE / 2, bit)
    }

    /// The lowest `count` bits of a number, the highest of them first.
    fn number(&mut self, value: u64, count: u32) -> u64 {
        (0..count).rev().fold(0, |made, place| {
            made << 1 | u64::from(self.plain(value >> place & 1 == 1))
        })
    }
}

/// One bit as the entropy coder takes it.
struct Bernoulli(u32);

impl EntropyModel<PRECISION> for Bernoulli {
    type Symbol = bool;
    type Probability = u32;
}

impl Bernoulli {
    /// Where the share of a bit begins, and how long it is; zeros come first.
    fn share(&self, bit: bool) -> (u32, NonZeroU32) {
        let (from, length) = match bit {
            false => (0, WHOLE - self.0),
            true => (WHOLE - self.0, self.0),
        };
        (from, NonZeroU32::new(length).unwrap_or(NonZeroU32::MIN))
    }
}

impl EncoderModel<PRECISION> for Bernoulli {
    fn left_cumulative_and_probability(
        &self,
        symbol: impl Borrow<bool>,
    ) -> Option<(u32, NonZeroU32)> {
        Some(self.share(*symbol.borrow()))
    }
}

impl DecoderModel<PRECISION> for Bernoulli {
    fn quantile_function(&self, quantile: u32) -> (bool, u32, NonZeroU32) {
        let bit = quantile >= WHOLE - self.0;
        let (from, length) = self.share(bit);
        (bit, from, length)
    }
}

/// Writes bits with a range coder, and counts what they cost.
#[derive(Debug, Clone)]
pub struct Writer {
    coder: DefaultRangeEncoder,
    spent: f64,
}

impl Writer {
    /// Nothing written yet.
    pub fn new() -> Self {
        Writer {
            coder: DefaultRangeEncoder::new(),
            spent: 0.0,
        }
    }

    /// Bits spent up to now, by the probabilities alone.
    pub fn spent(&self) -> f64 {
        self.spent
    }

    /// What was written: whole words of four bytes, less the zeros at the end, which a reader
    /// takes for granted.
    pub fn finish(self) -> Vec<u8> {
        let words = match self.coder.into_compressed() {
            Ok(words) => words,
            Err(never) => match never {},
        };
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
        let kept = bytes
            .iter()
            .rposition(|byte| *byte != 0)
            .map_or(0, |last| last + 1);
        bytes.truncate(kept);
        bytes
    }
}

impl Default for Writer {
    fn default() -> Self {
        Writer::new()
    }
}

/// Bits that something of this probability costs, to one part in 2^12.
fn cost(share: u32) -> f64 {
    static COSTS: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let middle = |i: u32| (f64::from(i) + 0.5) / 4096.0;
        (0..4096).map(|i| -middle(i).log2()).collect()
    });
    COSTS[(share >> (PRECISION - 12)) as usize]
}

/// Keeps nothing: for models that learn from numbers that are written later.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwritten;

impl Coder for Unwritten {
    fn bit(&mut self, _one: u32, bit: bool) -> bool {
        bit
    }
}

impl Coder for Writer {
    fn bit(&mut self, one: u32, bit: bool) -> bool {
        debug_assert!(0 < one && one < WHOLE);
        self.spent += cost(if bit { one } else { WHOLE - one });
        self.coder
            .encode_symbol(bit, Bernoulli(one))
            .expect("memory takes every bit, and none has the probability 0");
        bit
    }
}

/// Reads what a [`Writer`] wrote; past its end there are zeros.
#[derive(Debug)]
pub struct Reader {
    decoder: DefaultRangeDecoder,
    broken: bool,
}

impl Reader {
    /// Reads these bytes.
    pub fn new(bytes: &[u8]) -> Self {
        let words = bytes.chunks(4).map(|chunk| {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            u32::from_be_bytes(word)
        });
        let words: Vec<u32> = words.collect();
        let decoder = match DefaultRangeDecoder::from_compressed(words) {
            Ok(decoder) => decoder,
            Err(never) => match never {},
        };
        Reader {
            decoder,
            broken: false,
        }
    }

    /// Errs where bits were met that no writer makes.
    pub fn check(&self) -> Result<(), Fault> {
        match self.broken {
            true => Err(Fault::whole(
                "a section has bits that no encoder makes; damaged",
            )),
            false => Ok(()),
        }
    }
}

impl Coder for Reader {
    fn bit(&mut self, one: u32, _bit: bool) -> bool {
        match self.decoder.decode_symbol(Bernoulli(one)) {
            Ok(bit) => bit,
            Err(_) => {
                self.broken = true;
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    #[test]
    fn bits_come_back_and_cost_what_their_probabilities_say() {
        let mut rng = Rng::new(7, 0);
        let made: Vec<(u32, bool)> = (0..20_000)
            .map(|_| {
                let one = 1 + rng.below(65_535) as u32;
                (one, rng.below(65_536) < one as usize)
            })
            .collect();
        let mut writer = Writer::new();
        for (one, bit) in &made {
            writer.bit(*one, *bit);
        }
        let bytes = writer.finish();
        let mut reader = Reader::new(&bytes);
        for (one, bit) in &made {
            assert_eq!(reader.bit(*one, false), *bit);
        }
        assert!(reader.check().is_ok());
        let ideal: f64 = made
            .iter()
            .map(|(one, bit)| {
                let share = if *bit { *one } else { WHOLE - one };
                -(f64::from(share) / f64::from(WHOLE)).log2()
            })
            .sum();
        let bits = 8.0 * bytes.len() as f64;
        assert!(
            bits >= ideal - 1.0 && bits <= ideal * 1.001 + 64.0,
            "{bits} for {ideal}"
        );
    }

    #[test]
    fn plain_numbers_come_back_from_the_shortest_stream() {
        let mut writer = Writer::new();
        writer.number(0x1234_5678_9abc, 48);
        writer.number(0, 30);
        let bytes = writer.finish();
        assert!(bytes.len() <= 12, "{}", bytes.len());
        let mut reader = Reader::new(&bytes);
        assert_eq!(reader.number(0, 48), 0x1234_5678_9abc);
        assert_eq!(reader.number(0, 30), 0);
    }

    #[test]
    fn noise_is_read_without_a_panic() {
        let mut rng = Rng::new(3, 1);
        let bytes: Vec<u8> = (0..64).map(|_| rng.below(256) as u8).collect();
        let mut reader = Reader::new(&bytes);
        for i in 0..10_000u32 {
            reader.bit(1 + i * 6 % 65_535, false);
        }
    }
}

//! Random mutations of files.

use super::corpus::Case;
use linelit_testkit::rng::SplitMix64;

/// Returns a random number below `n`, or 0.
pub(crate) fn below(random: &mut SplitMix64, n: usize) -> usize {
    usize::try_from(random.next_u64() >> 8).unwrap_or(0) % n.max(1)
}

/// Numbers near the limits of arithmetic.
const EDGES: [&str; 14] = [
    "0",
    "-1",
    "1e38",
    "3.5e38",
    "1e-45",
    "-0",
    "1e308",
    "1e-320",
    "4294967295",
    "2147483648",
    "nan",
    "inf",
    "1e19",
    "65536",
];

/// Changes some bytes of one or two files of a case.
pub(crate) fn mutate(case: &mut Case, random: &mut SplitMix64) {
    let names: Vec<String> = case.files.keys().cloned().collect();
    for _ in 0..=below(random, 2) {
        let name = &names[below(random, names.len())];
        let Some(bytes) = case.files.get_mut(name) else {
            continue;
        };
        for _ in 0..=below(random, 6) {
            change(bytes, random);
        }
        // With a wrong checksum, readers would examine no other byte.
        if below(random, 4) > 0 {
            mend_checksums(bytes);
        }
    }
}

fn change(bytes: &mut Vec<u8>, random: &mut SplitMix64) {
    if bytes.is_empty() {
        return;
    }
    let i = below(random, bytes.len());
    let [kind, value, ..] = random.next_u64().to_le_bytes();
    let end = (i + usize::from(value)).min(bytes.len());
    match kind % 10 {
        0 => bytes[i] = value,
        1 => bytes[i] ^= 1 << (value % 8),
        2 => bytes.insert(i, value),
        3 => drop(bytes.remove(i)),
        4 => {
            let copy = bytes[i..end].to_vec();
            bytes.splice(i..i, copy);
        }
        5 => drop(bytes.drain(i..end)),
        6 => bytes.truncate(i),
        // A digit becomes another one: numbers stay numbers but change.
        7 => {
            if let Some(b) = bytes[i..].iter_mut().find(|b| b.is_ascii_digit()) {
                *b = b'0' + value % 10;
            }
        }
        // A number becomes one at an edge.
        8 => {
            let is_part = |b: &u8| b.is_ascii_digit() || b".-e".contains(b);
            if let Some(start) = bytes[i..].iter().position(u8::is_ascii_digit) {
                let start = i + start;
                let length = bytes[start..].iter().take_while(|b| is_part(b)).count();
                let edge = EDGES[usize::from(value) % EDGES.len()];
                bytes.splice(start..start + length, edge.bytes());
            }
        }
        // Four bytes of a binary number.
        _ => {
            let word = [
                u32::MAX,
                1 << 31,
                0,
                1,
                0x7f80_0000,
                0x7fc0_0000,
                0x6000_0000,
                0xff7f_ffff,
            ];
            let word = word[usize::from(value) % word.len()].to_le_bytes();
            for (b, new) in bytes[i..].iter_mut().zip(word) {
                *b = new;
            }
        }
    }
}

/// Makes the checksums of PNG chunks and of a stored gzip member right again.
fn mend_checksums(bytes: &mut Vec<u8>) {
    if bytes.starts_with(b"\x89PNG") {
        let mut at = 8;
        while let Some(length) = bytes.get(at..at + 4).and_then(|b| b.first_chunk()) {
            let end = at.saturating_add(8 + u32::from_be_bytes(*length) as usize);
            let Some(covered) = bytes.get(at + 4..end) else {
                break;
            };
            let crc = crc32(covered).to_be_bytes();
            match bytes.get_mut(end..end + 4) {
                Some(place) => place.copy_from_slice(&crc),
                None => break,
            }
            at = end + 4;
        }
    }
    // Replace a compressed member by stored blocks, so that mutations change the contents.
    if bytes.starts_with(b"\x1f\x8b") {
        let text = b"Shape \"sphere\" \"float radius\" 1 AreaLightSource \"diffuse\"\n";
        let mut contents: Vec<u8> = text.repeat(2);
        let place = bytes.iter().map(|b| usize::from(*b)).sum::<usize>() % contents.len();
        contents[place] = bytes[bytes.len() / 2];
        *bytes = stored_gzip(&contents);
    }
}

fn stored_gzip(contents: &[u8]) -> Vec<u8> {
    let n = u16::try_from(contents.len()).unwrap_or(0);
    let mut bytes = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 1];
    bytes.extend(n.to_le_bytes());
    bytes.extend((!n).to_le_bytes());
    bytes.extend(contents);
    bytes.extend(crc32(contents).to_le_bytes());
    bytes.extend(u32::from(n).to_le_bytes());
    bytes
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            if c & 1 == 1 {
                0xedb8_8320 ^ (c >> 1)
            } else {
                c >> 1
            }
        })
    };
    !bytes.iter().fold(u32::MAX, step)
}

//! Rust text as the house rules see it: without comments, literals and tests.

/// Replaces comments, strings and character literals by blanks; lines and columns stay where they
/// are.
pub(crate) fn code_only(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    let mut i = 0;
    while i < chars.len() {
        let end = skip(&chars, i);
        if end > i {
            out.extend(
                chars[i..end]
                    .iter()
                    .map(|c| if *c == '\n' { '\n' } else { ' ' }),
            );
            i = end;
        } else {
            out.push(chars[i]);
            i += 1;
        }
    }
    out
}

/// The end of the comment or literal that begins at `i`; `i` if none does.
fn skip(chars: &[char], i: usize) -> usize {
    let at = |k: usize| chars.get(k).copied().unwrap_or('\0');
    let identifier_before = i > 0 && (at(i - 1).is_alphanumeric() || at(i - 1) == '_');
    match (at(i), at(i + 1)) {
        ('/', '/') => (i..chars.len())
            .find(|&k| at(k) == '\n')
            .unwrap_or(chars.len()),
        ('/', '*') => block_comment(chars, i),
        ('r', '"' | '#') if !identifier_before => raw_string(chars, i + 1).unwrap_or(i),
        ('b', 'r') if !identifier_before => raw_string(chars, i + 2).unwrap_or(i),
        ('"', _) => quoted(chars, i, '"'),
        // A lifetime has no closing quote after one character.
        ('\'', '\\') => quoted(chars, i, '\''),
        ('\'', _) if at(i + 2) == '\'' => i + 3,
        _ => i,
    }
}

fn block_comment(chars: &[char], start: usize) -> usize {
    let (mut depth, mut i) = (0, start);
    while i + 1 < chars.len() {
        match (chars[i], chars[i + 1]) {
            ('/', '*') => (depth, i) = (depth + 1, i + 2),
            ('*', '/') => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    chars.len()
}

fn quoted(chars: &[char], start: usize, quote: char) -> usize {
    let mut i = start + 1;
    while i < chars.len() {
        match chars[i] {
            '\\' => i += 2,
            c if c == quote => return i + 1,
            _ => i += 1,
        }
    }
    chars.len()
}

/// The end of a raw string whose hashes begin at `hashes`, if it is one.
fn raw_string(chars: &[char], hashes: usize) -> Option<usize> {
    let count = chars[hashes..].iter().take_while(|c| **c == '#').count();
    if chars.get(hashes + count) != Some(&'"') {
        return None;
    }
    let mut i = hashes + count + 1;
    while i < chars.len() {
        let closed = chars[i] == '"'
            && chars[i + 1..]
                .iter()
                .take(count)
                .filter(|c| **c == '#')
                .count()
                == count;
        if closed {
            return Some(i + 1 + count);
        }
        i += 1;
    }
    Some(chars.len())
}

/// Blanks out items marked `#[cfg(test)]` (in text from [`code_only`]).
pub(crate) fn without_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(test)]";
    let mut out = code.to_owned();
    while let Some(start) = out.find(MARK) {
        let end = item_end(&out, start + MARK.len());
        let blank: String = out[start..end]
            .chars()
            .map(|c| if c == '\n' { '\n' } else { ' ' })
            .collect();
        out.replace_range(start..end, &blank);
    }
    out
}

/// The end of the item at `from`: its closing brace, or a semicolon before any brace.
fn item_end(code: &str, from: usize) -> usize {
    let mut depth = 0_i32;
    for (offset, c) in code[from..].char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return from + offset + 1,
            _ => continue,
        }
        if depth == 0 {
            return from + offset + 1;
        }
    }
    code.len()
}

/// Lines (from 1) on which `word` stands, not as part of a longer identifier.
pub(crate) fn lines_with(code: &str, word: &str) -> Vec<usize> {
    code.lines()
        .enumerate()
        .filter(|(_, line)| has_word(line, word))
        .map(|(i, _)| i + 1)
        .collect()
}

fn has_word(line: &str, word: &str) -> bool {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(i, _)| {
        let before = line[..i].chars().next_back();
        let after = line[i + word.len()..].chars().next();
        let edge = word.chars().next_back().is_some_and(inside);
        let joined = before.is_some_and(inside) || (edge && after.is_some_and(inside));
        !joined
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_comments_and_literals() {
        let text =
            "a // println!\n/* x /* y */ z */ b \"std::fs\\\"\" r#\"q\"dyn\"# 'c' '\\'' &'a str";
        let code = code_only(text);
        assert_eq!(code.len(), text.len());
        for gone in ["println", "x", "z", "std", "dyn", "'c'"] {
            assert!(!code.contains(gone), "{gone} in {code}");
        }
        assert!(code.contains("&'a str") && code.contains('b'));
    }

    #[test]
    fn blanks_test_modules() {
        let code = without_tests(
            "fn a() {}\n#[cfg(test)]\nmod tests {\n fn b() { dyn }\n}\nfn c() {}\n#[cfg(test)]\nmod t;\nfn d() {}",
        );
        assert!(!code.contains("dyn") && !code.contains("mod t"));
        assert!(code.contains("fn a") && code.contains("fn c") && code.contains("fn d"));
        assert_eq!(lines_with(&code, "c"), [6]);
    }

    #[test]
    fn words_have_edges() {
        assert_eq!(
            lines_with("use rand::x;\nlet operand = 1;\nrand_pcg::y", "rand"),
            [1]
        );
        assert_eq!(lines_with("std::fs::read\nstd::fsx", "std::fs"), [1]);
        assert_eq!(lines_with("eprintln!(\nprintln!(", "println!"), [2]);
    }
}

//! Rust as a row of tokens, without comments: enough to find items and print their signatures.

/// One token, and whether white space or a comment stood before it.
struct Token {
    text: String,
    apart: bool,
}

/// The tokens of a file.
pub(super) struct Tokens {
    tokens: Vec<Token>,
    /// For each opening bracket where its partner is; the token's own index for all others.
    partner: Vec<usize>,
}

impl Tokens {
    pub(super) fn of(text: &str) -> Self {
        let mut tokens = Vec::new();
        let (mut rest, mut apart) = (text, false);
        while let Some(first) = rest.chars().next() {
            let length = if first.is_whitespace() {
                first.len_utf8()
            } else {
                length(rest)
            };
            let (token, behind) = rest.split_at(length);
            rest = behind;
            if first.is_whitespace() || token.starts_with("//") || token.starts_with("/*") {
                apart = true;
                continue;
            }
            let text = token.to_owned();
            tokens.push(Token { text, apart });
            apart = false;
        }
        let mut partner: Vec<usize> = (0..tokens.len()).collect();
        let mut open = Vec::new();
        for (i, token) in tokens.iter().enumerate() {
            match token.text.as_str() {
                "(" | "[" | "{" => open.push(i),
                ")" | "]" | "}" => open.pop().into_iter().for_each(|o| partner[o] = i),
                _ => (),
            }
        }
        Self { tokens, partner }
    }

    pub(super) fn len(&self) -> usize {
        self.tokens.len()
    }

    /// The token there; nothing past the end.
    pub(super) fn at(&self, i: usize) -> &str {
        self.tokens.get(i).map_or("", |t| t.text.as_str())
    }

    /// What stands behind the group that opens there; behind the token if none does.
    pub(super) fn behind(&self, i: usize) -> usize {
        self.partner.get(i).map_or(i, |partner| *partner) + 1
    }

    /// The first of some tokens between two places, outside of groups, unless it opens one itself.
    pub(super) fn find(&self, mut from: usize, to: usize, wanted: &[&str]) -> Option<usize> {
        while from < to {
            if wanted.contains(&self.at(from)) {
                return Some(from);
            }
            from = self.behind(from);
        }
        None
    }

    /// What stands behind the generic parameters that open there, if any do.
    pub(super) fn behind_generics(&self, i: usize) -> usize {
        let (mut at, mut depth) = (i, 0_usize);
        loop {
            match self.at(at) {
                "<" => depth += 1,
                // Not the end of an arrow.
                ">" if self.at(at - 1) != "-" => depth = depth.saturating_sub(1),
                "" => return at,
                _ => (),
            }
            if depth == 0 {
                return if at == i && self.at(i) != "<" {
                    i
                } else {
                    at + 1
                };
            }
            at = self.behind(at);
        }
    }

    /// The parts between commas.
    pub(super) fn parts(&self, mut from: usize, to: usize) -> Vec<(usize, usize)> {
        let (mut parts, mut at, mut depth) = (Vec::new(), from, 0_usize);
        while at < to {
            match self.at(at) {
                "<" => depth += 1,
                ">" if self.at(at - 1) != "-" => depth = depth.saturating_sub(1),
                "," if depth == 0 => {
                    parts.push((from, at));
                    from = at + 1;
                }
                _ => (),
            }
            at = self.behind(at);
        }
        if from < to {
            parts.push((from, to));
        }
        parts
    }

    /// A run of tokens on one line, as rustfmt would write it if lines were long enough.
    pub(super) fn text(&self, from: usize, to: usize) -> String {
        let mut line = String::new();
        for i in from..to.min(self.tokens.len()) {
            let token = &self.tokens[i];
            let opened = line.ends_with(['(', '[', '<']);
            let closes = matches!(token.text.as_str(), ")" | "]" | ">") && !line.ends_with('-');
            let last = closes || token.text == "}";
            if last && token.apart && line.ends_with(',') {
                line.pop();
            }
            if token.apart && !line.is_empty() && !opened && !closes {
                line.push(' ');
            }
            line.push_str(&token.text);
        }
        line.truncate(line.trim_end_matches([',', ' ']).len());
        line
    }
}

/// How many bytes the token (or comment) that a text begins with has.
fn length(text: &str) -> usize {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let until = |end: &str| text.find(end).map_or(text.len(), |i| i + end.len());
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        return until("*/");
    }
    let prefix = text.len() - text.trim_start_matches(['b', 'r', 'c']).len();
    let hashes = text[prefix..].len() - text[prefix..].trim_start_matches('#').len();
    if prefix <= 2 && text[prefix + hashes..].starts_with('"') && text[..prefix].contains('r') {
        let (begin, end) = (prefix + hashes + 1, format!("\"{}", "#".repeat(hashes)));
        let length = text[begin..].find(&end).map(|i| begin + i + end.len());
        return length.unwrap_or(text.len());
    }
    if prefix <= 1 && text[prefix..].starts_with('"') {
        return quoted(text, prefix, '"');
    }
    if prefix <= 1 && text[prefix..].starts_with('\'') {
        let mut inside = text[prefix + 1..].chars();
        let (first, second) = (inside.next(), inside.next());
        if first == Some('\\') || second == Some('\'') {
            return quoted(text, prefix, '\'');
        }
        let name = text[1..].find(|c| !word(c)).unwrap_or(text.len() - 1);
        return 1 + name;
    }
    let first = text.chars().next().map_or(1, char::len_utf8);
    match text.find(|c| !word(c)) {
        Some(0) => first,
        Some(end) => end,
        None => text.len(),
    }
}

/// The length of a text in quotes that may hold escapes.
fn quoted(text: &str, prefix: usize, quote: char) -> usize {
    let mut escaped = false;
    for (i, c) in text.char_indices().skip(prefix + 1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return i + 1,
            _ => (),
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_hold_no_brackets() {
        let text = r##"f('{', b'\'', "}\"", r#"("#, 'a: loop {}, /* ) */ x) // {"##;
        let tokens = Tokens::of(text);
        assert_eq!(tokens.behind(1), tokens.len());
        let words = [2, 4, 6, 8, 10].map(|i| tokens.at(i));
        assert_eq!(words, ["'{'", "b'\\''", "\"}\\\"\"", "r#\"(\"#", "'a"]);
    }

    #[test]
    fn lines_are_joined() {
        let broken = "fn f<\n T: A,\n>(\n  a: &[u8],\n  b: (X,),\n) -> Y<X>\nwhere\n  T: B,\n{";
        let tokens = Tokens::of(broken);
        let joined = tokens.text(0, tokens.len() - 1);
        assert_eq!(joined, "fn f<T: A>(a: &[u8], b: (X,)) -> Y<X> where T: B");
        let arrow = Tokens::of("<F: Fn(A) -> B> x");
        assert_eq!(arrow.at(arrow.behind_generics(0)), "x");
        let parts = Tokens::of("a: M<A, B>, b: (C, D),");
        assert_eq!(parts.parts(0, parts.len()).len(), 2);
    }
}

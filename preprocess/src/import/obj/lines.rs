//! The lines of a text file, as bytes: names in OBJ and MTL files come in any encoding.

/// The text behind a UTF-8 byte order mark, if there is one.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Iterates over the lines of a text. A line ends at CR, LF or CR LF.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { rest: text }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let is_end = |&byte: &u8| byte == b'\n' || byte == b'\r';
        let end = self.rest.iter().position(is_end);
        let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        let rest = rest.strip_prefix(b"\r").unwrap_or(rest);
        // A lone CR has been taken already; what it precedes is the next line unless it is LF.
        self.rest = rest.strip_prefix(b"\n").unwrap_or(rest);
        Some(line)
    }
}

/// Splits a line at its first white space into the keyword and what follows it.
pub(super) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii();
    let end = line.iter().position(u8::is_ascii_whitespace);
    let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
    (keyword, rest.trim_ascii())
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Reads a finite number.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let number: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_cr_lf_or_both() {
        let lines: Vec<_> = Lines::new(b"a\nb\r\nc\rd\n\n\re").collect();
        let expected: [&[u8]; 7] = [b"a", b"b", b"c", b"d", b"", b"", b"e"];
        assert_eq!(lines, expected);
        assert_eq!(Lines::new(b"a\n").count(), 1);
        assert_eq!(Lines::new(b"").count(), 0);
    }
}

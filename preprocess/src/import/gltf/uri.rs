//! URIs of buffers (section 2.8) as names of files.
//!
//! What a URI means is one thing, what exporters write is another: names with `%`, `#` and `?` that are not escaped,
//! backslashes, letters with accents in the other of Unicode's two forms. So a URI stands for several names, and the
//! first that is there is read. The one that the standard means comes first.

use super::{ImportError, Result};
use crate::import::folder::percent_decode;
use unicode_normalization::UnicodeNormalization;

/// Whether the URI holds the data itself.
pub(super) fn is_data(uri: &str) -> bool {
    let scheme = uri.get(..5);
    scheme.is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// The names that `uri` may stand for, without repetitions, at least one. Paths use `/`.
pub(super) fn file_names(uri: &str) -> Result<Vec<String>> {
    let path = local_path(uri)?;
    let is_end = |c: char| c == '?' || c == '#';
    let mut names = Vec::new();
    // Without a query or a fragment only where no file has them in its name.
    for text in [Some(path), path.find(is_end).map(|end| &path[..end])]
        .into_iter()
        .flatten()
    {
        names.extend(String::from_utf8(percent_decode(text)));
        names.push(text.to_owned());
    }
    let variants: [fn(&str) -> String; 3] = [
        |name| name.replace('\\', "/"),
        |name| name.nfc().collect(),
        |name| name.nfd().collect(),
    ];
    for variant in variants {
        names.extend(names.clone().iter().map(|name| variant(name)));
    }
    let mut unlike: Vec<String> = Vec::new();
    for name in names {
        if !unlike.contains(&name) {
            unlike.push(name);
        }
    }
    Ok(unlike)
}

/// The path of a URI that names a file here: it has no scheme, or `file:`.
fn local_path(uri: &str) -> Result<&str> {
    let refused = |why: &str| {
        ImportError::malformed(format!("{uri:?} {why}"))
            .next("put the file beside the scene and refer to it by its name")
    };
    let Some((scheme, rest)) = uri.split_once("://") else {
        return Ok(uri);
    };
    if !scheme.eq_ignore_ascii_case("file") {
        return Err(refused("is a network address"));
    }
    // file://HOST/PATH, where the host is mostly left out.
    let (host, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
    if !host.is_empty() && !host.eq_ignore_ascii_case("localhost") {
        return Err(refused("is a file of another computer"));
    }
    // In file:///C:/x.bin the path is C:/x.bin.
    match path.as_bytes() {
        [b'/', drive, b':', ..] if cfg!(windows) && drive.is_ascii_alphabetic() => Ok(&path[1..]),
        _ => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_meaning_of_the_standard_comes_first() {
        let names = |uri: &str| file_names(uri).unwrap();
        assert_eq!(names("box.bin"), ["box.bin"]);
        assert_eq!(names("a+b%20c.bin"), ["a+b c.bin", "a+b%20c.bin"]);
        assert_eq!(names("100%.bin"), ["100%.bin"]);
        assert_eq!(names("a.bin?v=1#x"), ["a.bin?v=1#x", "a.bin"]);
        assert_eq!(names("part%231.bin"), ["part#1.bin", "part%231.bin"]);
        assert_eq!(names(r"m\a.bin"), [r"m\a.bin", "m/a.bin"]);
        assert_eq!(names("\u{e4}"), ["\u{e4}", "a\u{308}"]);
        assert_eq!(names("a%CC%88"), ["a\u{308}", "a%CC%88", "\u{e4}"]);
        assert_eq!(names("%FF.bin"), ["%FF.bin"], "no escape of UTF-8");
        assert_eq!(names("FILE:///a%20b/c.bin")[0], "/a b/c.bin");
        assert_eq!(names("file://localhost/c.bin"), ["/c.bin"]);
        for (uri, why) in [
            ("https://x.org/a.bin", "network address"),
            ("file://server/a.bin", "another computer"),
        ] {
            let error = file_names(uri).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }
}

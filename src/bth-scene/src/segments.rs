//! Cuts a manifest between its tables of nodes, so that each can be parsed when it is needed: a
//! parsed table takes thirty times the memory of its text.

use std::ops::Range;

/// The text of a manifest in parts.
pub(crate) struct Segments {
    /// Each `[[nodes]]` with all that belongs to it.
    pub(crate) nodes: Vec<Range<u32>>,
    /// All else, in one piece.
    pub(crate) rest: String,
    /// Where pieces of the rest begin, there and in the whole text.
    pub(crate) pieces: Vec<(usize, usize)>,
}

impl Segments {
    /// Cuts a text of less than 4 GiB. What is malformed stays in one part, in which the parser
    /// finds it.
    pub(crate) fn of(text: &str) -> Self {
        let mut all = Self { nodes: Vec::new(), rest: String::new(), pieces: Vec::new() };
        let (mut first, mut in_node, mut at) = (0, false, 0);
        while at < text.len() {
            if let Some(header) = header(&text[at..]) {
                let is_of_node = first_key(header) == "nodes";
                let opens_node = is_of_node && header.starts_with("[[") && !header.contains('.');
                // A table below a node belongs to it, and so does one that makes no sense.
                if opens_node || !is_of_node && in_node {
                    all.add(text, first..at, in_node);
                    (first, in_node) = (at, opens_node);
                }
            }
            at += statement(&text.as_bytes()[at..]);
        }
        all.add(text, first..at, in_node);
        all
    }

    fn add(&mut self, text: &str, range: Range<usize>, is_node: bool) {
        if is_node {
            self.nodes.push(range.start as u32..range.end as u32);
        } else if !range.is_empty() {
            self.pieces.push((self.rest.len(), range.start));
            self.rest.push_str(&text[range]);
        }
    }
}

/// The line of a header of a table at the start of a text, if there is one.
fn header(text: &str) -> Option<&str> {
    text.starts_with('[').then(|| text.lines().next().unwrap_or_default())
}

fn first_key(header: &str) -> &str {
    let key = header.trim_start_matches(['[', ' ', '\t']);
    key.split(['.', ']']).next().unwrap_or_default().trim_matches([' ', '\t', '"', '\''])
}

/// Bytes of the first statement of a text: a key with its value, a header, a comment or an empty
/// line, with the end of its line; or the spaces before.
fn statement(text: &[u8]) -> usize {
    let spaces = text.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
    if spaces > 0 {
        return spaces;
    }
    let (mut at, mut depth) = (0, 0usize);
    while let Some(byte) = text.get(at) {
        at += match byte {
            b'\n' if depth == 0 => return at + 1,
            b'#' => text[at..].iter().take_while(|byte| **byte != b'\n').count(),
            b'"' | b'\'' => string(&text[at..]),
            b'[' | b'{' => {
                depth += 1;
                1
            }
            b']' | b'}' => {
                depth = depth.saturating_sub(1);
                1
            }
            _ => 1,
        };
    }
    at
}

/// Bytes of the string at the start of a text.
fn string(text: &[u8]) -> usize {
    let (quote, end) = (text[0], text.len());
    let marks = if text.starts_with(&[quote; 3]) { 3 } else { 1 };
    let mut at = marks;
    while let Some(byte) = text.get(at) {
        match byte {
            // The text may end behind the backslash.
            b'\\' if quote == b'"' => at = end.min(at + 2),
            b'\n' if marks == 1 => return at,
            _ if text[at..].starts_with(&[quote; 3][..marks]) => {
                at += marks;
                // Up to two quotes may be the end of what is quoted.
                let more = text[at..].iter().take(2).take_while(|byte| **byte == quote).count();
                return at + if marks == 3 { more } else { 0 };
            }
            _ => at += 1,
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(text: &str) -> (Vec<&str>, String) {
        let Segments { nodes, rest, pieces } = Segments::of(text);
        for (i, (there, here)) in pieces.iter().enumerate() {
            let end = pieces.get(i + 1).map_or(rest.len(), |(end, _)| *end);
            assert_eq!(rest[*there..end], text[*here..*here + end - there]);
        }
        (nodes.iter().map(|range| &text[range.start as usize..range.end as usize]).collect(), rest)
    }

    #[test]
    fn nodes_are_cut_from_all_else_with_what_belongs_to_them() {
        let text = "version = 1\n[[objects]]\nname = 'x'\n[[nodes]]\nname = \"a\"\n[nodes.look]\nto = [1,\n 2]\n \
            [[ \"nodes\" ]] # b\nname = '''\n[[nodes]]\n'''\n[[cameras]]\nname = \"[\"\n[[nodes]]\nx = \"\\\"\n[[tracks]]\n";
        let (nodes, rest) = cut(text);
        assert_eq!(nodes.len(), 3);
        assert_eq!(nodes[0], "[[nodes]]\nname = \"a\"\n[nodes.look]\nto = [1,\n 2]\n ");
        assert!(nodes[1].ends_with("'''\n") && nodes[2].starts_with("[[nodes]]\nx"));
        assert_eq!(rest, "version = 1\n[[objects]]\nname = 'x'\n[[cameras]]\nname = \"[\"\n[[tracks]]\n");
    }

    #[test]
    fn texts_without_tables_of_nodes_stay_whole() {
        for text in [
            "",
            "nodes = [\n[[nodes]]\n]\n",
            "a = \"\"\"\n[[nodes]]\n\"\"\"\"\n",
            "[nodes]\n",
            "# [[nodes]]\n[x]",
            "a = \"\\",
            "a = \"\\\u{fffd}",
        ] {
            assert_eq!(cut(text), (vec![], text.to_owned()));
        }
    }
}

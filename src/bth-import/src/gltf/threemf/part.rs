//! A part of a 3MF package: its elements, their attributes, and errors at lines.

use std::borrow::Cow;
use std::str::FromStr;

use quick_xml::NsReader;
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::{NamespaceResolver, ResolveResult};

use crate::error::{Error, Result};
use crate::gltf::threemf::EXPORT;
use crate::source::{MALFORMED, Source, TRUNCATED};
use crate::text::{float, shown, without_mark};

/// The number of elements that an element may be in.
const DEEPEST: usize = 256;
/// The attribute with the name of another part has the prefix of an extension.
const PATH: &str = "path";

pub(super) struct Part<'a> {
    pub(super) source: &'a Source<'a>,
    pub(super) name: String,
    pub(super) text: Vec<u8>,
}

/// The start of an element.
pub(super) struct PartElement<'e> {
    part: &'e Part<'e>,
    start: &'e BytesStart<'e>,
    resolver: &'e NamespaceResolver,
    at: u64,
}

/// What follows the start of an element.
#[derive(PartialEq)]
pub(super) enum Then {
    /// What is in it.
    Inside,
    /// What comes after its end.
    Behind,
}

impl Part<'_> {
    /// An error at a byte of the part, which is named by its line.
    fn error(&self, code: &'static str, at: u64, message: impl Into<String>) -> Error {
        self.source.error_in_part(code, self.line(at), message, EXPORT)
    }

    /// The line of a byte, from 1.
    fn line(&self, at: u64) -> String {
        let lines = self.text.iter().take(at as usize).filter(|c| **c == b'\n').count();
        format!("{} line {}", self.name, lines + 1)
    }

    /// Calls `start` with the namespace, the name and the element, and `end` with the name alone,
    /// in the order of the text.
    pub(super) fn elements<V>(
        &self,
        visitor: &mut V,
        start: impl Fn(&mut V, &[u8], &[u8], &PartElement<'_>) -> Result<Then>,
        end: impl Fn(&mut V, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let text = without_mark(&self.text);
        let before = (self.text.len() - text.len()) as u64;
        let mut reader = NsReader::from_reader(text);
        reader.config_mut().expand_empty_elements = true;
        let (mut depth, mut behind) = (0, None);
        for number in 0.. {
            self.source.tick(number, 0)?;
            let at = before + reader.buffer_position();
            let event = reader.read_event().map_err(|e| {
                let message = format!("expected XML, found: {e}");
                self.error(MALFORMED, before + reader.error_position(), message)
            })?;
            match event {
                Event::Start(element) => {
                    depth += 1;
                    if depth > DEEPEST {
                        let message =
                            format!("expected at most {DEEPEST} elements in each other, found more");
                        return Err(self.error(MALFORMED, at, message));
                    }
                    if behind.is_none() {
                        let resolver = reader.resolver();
                        let (found, name) = resolver.resolve_element(element.name());
                        let namespace = match &found {
                            ResolveResult::Bound(namespace) => namespace.as_ref(),
                            _ => b"",
                        };
                        let it = PartElement { part: self, start: &element, resolver, at };
                        if start(visitor, namespace, name.as_ref(), &it)? == Then::Behind {
                            behind = Some(depth);
                        }
                    }
                }
                Event::End(element) => {
                    if behind.is_none() {
                        end(visitor, element.local_name().as_ref())?;
                    }
                    behind = behind.filter(|behind| *behind < depth);
                    depth -= 1;
                }
                Event::DocType(_) => {
                    return Err(self.error(MALFORMED, at, "expected elements, found a document type"));
                }
                Event::Eof if depth > 0 => {
                    return Err(self.error(
                        TRUNCATED,
                        at,
                        "expected the end of an element, found the end of the part",
                    ));
                }
                Event::Eof => break,
                _ => {}
            }
        }
        Ok(())
    }
}

impl PartElement<'_> {
    pub(super) fn error(&self, code: &'static str, message: impl Into<String>) -> Error {
        self.part.error(code, self.at, message)
    }

    /// Its part and line.
    pub(super) fn place(&self) -> String {
        self.part.line(self.at)
    }

    /// The namespace of a prefix.
    pub(super) fn namespace(&self, prefix: &str) -> String {
        let name = format!("{prefix}:x");
        let found = self.resolver.resolve_element(quick_xml::name::QName(name.as_bytes())).0;
        let ResolveResult::Bound(namespace) = found else { return String::new() };
        String::from_utf8_lossy(namespace.as_ref()).into_owned()
    }

    /// The values of attributes.
    pub(super) fn values<const N: usize>(&self, names: [&str; N]) -> Result<[Option<Cow<'_, [u8]>>; N]> {
        let mut values = [const { None }; N];
        for attribute in self.start.attributes().with_checks(false) {
            let attribute =
                attribute.map_err(|e| self.error(MALFORMED, format!("expected attributes, found: {e}")))?;
            let name =
                if names == [PATH; N] { attribute.key.local_name().into_inner() } else { attribute.key.0 };
            if let Some(k) = names.iter().position(|wanted| wanted.as_bytes() == name) {
                values[k] = Some(attribute.value);
            }
        }
        Ok(values)
    }

    /// The number that is the value of an attribute.
    pub(super) fn number<T: FromStr>(&self, name: &str, value: &Option<Cow<'_, [u8]>>) -> Result<Option<T>> {
        let number = |value: &Cow<'_, [u8]>| {
            float(value.trim_ascii()).ok_or_else(|| {
                let message = format!("expected a number as {name}, found \"{}\"", shown(value));
                self.error(MALFORMED, message)
            })
        };
        value.as_ref().map(number).transpose()
    }

    /// The numbers that are the values of attributes, which must be there.
    pub(super) fn numbers<T: FromStr + Copy, const N: usize>(&self, names: [&str; N]) -> Result<[T; N]> {
        let values = self.values(names)?;
        let mut numbers = [None; N];
        for ((number, value), name) in numbers.iter_mut().zip(&values).zip(names) {
            *number = Some(self.number(name, value)?.ok_or_else(|| self.missing(name))?);
        }
        Ok(numbers.map(|number| number.expect("each is set above")))
    }

    pub(super) fn missing(&self, name: &str) -> Error {
        self.error(MALFORMED, format!("expected the attribute {name}, found none"))
    }

    /// The text of attributes, empty for those that are missing.
    pub(super) fn texts<const N: usize>(&self, names: [&str; N]) -> Result<[String; N]> {
        let text = |value: Option<Cow<'_, [u8]>>| {
            let text = String::from_utf8_lossy(&value.unwrap_or_default()).into_owned();
            quick_xml::escape::unescape(&text).map_or_else(|_| text.clone(), Cow::into_owned)
        };
        Ok(self.values(names)?.map(text))
    }
}

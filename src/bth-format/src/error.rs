//! Why a file was refused: a stable code for each numbered invariant of the specification, with
//! place, expected and found.

pub use crate::code::Code;
use crate::layout::{NONE, kind};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// What opening and checking return.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// The section that an error is about. Specification: "Kinds".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// One of [`kind`], or the kind of an unknown section.
    pub kind: u32,
    /// The object, or [`NONE`] for sections of the whole file.
    pub object: u32,
}

/// Why a file cannot be used: the code, the place, what is expected there and what was found.
// A pointer, since functions that return errors are many, and each would have to move all of this.
#[derive(Debug)]
pub struct Error(Box<Details>);

#[derive(Debug)]
struct Details {
    code: Code,
    section: Option<Section>,
    offset: Option<u64>,
    expected: Cow<'static, str>,
    found: Cow<'static, str>,
    /// True if there was not enough memory.
    memory: bool,
    path: Option<PathBuf>,
    source: Option<std::io::Error>,
}

/// The hint where there is not enough memory.
const MEMORY_HINT: &str = "free memory or raise its limit (ulimit -v), or map the file";

impl Error {
    /// An error outside of sections, at a byte of the file.
    pub(crate) fn at(
        code: Code,
        offset: u64,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::new(code, None, Some(offset), (expected.into(), found.into()))
    }
    /// An error within a section of object 0; `offset` counts from the section's start.
    /// [`crate::File::locate`] turns it into an error of the right object with an offset from the
    /// start of the file.
    pub(crate) fn within(
        code: Code,
        kind: u32,
        offset: u64,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Self {
        let section = Some(Section { kind, object: 0 });
        Self::new(code, section, Some(offset), (expected.into(), found.into()))
    }
    /// An error within a section of the whole file; `offset` counts from the section's start, until
    /// [`crate::File::locate`] turns it into an offset from the start of the file.
    pub fn within_file(
        code: Code,
        kind: u32,
        offset: u64,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::within(code, kind, offset, expected, found).in_object(NONE)
    }
    /// An error of a call, which is about no file.
    pub fn of_call(
        code: Code,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self::new(code, None, None, (expected.into(), found.into()))
    }
    /// An error of the operating system.
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        let mut error =
            Self::new(Code::Read, None, None, ("a readable file".into(), format!("{source}").into()));
        error.0.memory = source.kind() == std::io::ErrorKind::OutOfMemory;
        (error.0.path, error.0.source) = (Some(path.to_owned()), Some(source));
        error
    }
    /// The error where there is no memory of this size.
    pub(crate) fn memory(bytes: u64) -> Self {
        let mut error = Self::at(Code::Read, 0, format!("{bytes} bytes of memory"), "less");
        error.0.memory = true;
        error
    }
    #[cold]
    #[inline(never)]
    fn new(
        code: Code,
        section: Option<Section>,
        offset: Option<u64>,
        (expected, found): (Cow<'static, str>, Cow<'static, str>),
    ) -> Self {
        Error(Box::new(Details {
            code,
            section,
            offset,
            expected,
            found,
            memory: false,
            path: None,
            source: None,
        }))
    }
    /// The same error with the object that its section belongs to.
    pub(crate) fn in_object(mut self, object: u32) -> Self {
        if let Some(section) = &mut self.0.section {
            section.object = object;
        }
        self
    }
    /// The same error with its offset moved from the section's start to the file's.
    pub(crate) fn move_by(mut self, start: u64) -> Self {
        self.0.offset = self.0.offset.map(|o| o.saturating_add(start));
        self
    }
    /// The same error at another byte of its section.
    pub(crate) fn moved_to(mut self, offset: u64) -> Self {
        self.0.offset = Some(offset);
        self
    }
    /// The same error with the path of its file.
    pub fn in_file(mut self, path: &Path) -> Self {
        self.0.path.get_or_insert_with(|| path.to_owned());
        self
    }

    /// What was violated.
    pub fn code(&self) -> Code {
        self.0.code
    }
    /// The section, where the error is about one.
    pub fn section(&self) -> Option<Section> {
        self.0.section
    }
    /// Byte of the file, from 0, where the error is about one.
    pub fn offset(&self) -> Option<u64> {
        self.0.offset
    }
    /// What should be there.
    pub fn expected(&self) -> &str {
        &self.0.expected
    }
    /// What is there.
    pub fn found(&self) -> &str {
        &self.0.found
    }
    /// What the user can do about it.
    pub fn hint(&self) -> &'static str {
        if self.0.memory { MEMORY_HINT } else { self.0.code.hint() }
    }
    /// Returns true if there was not enough memory.
    pub fn is_of_memory(&self) -> bool {
        self.0.memory
    }
    /// The file, where it is known.
    pub fn path(&self) -> Option<&Path> {
        self.0.path.as_deref()
    }
}

impl Error {
    /// The text of the error without its hint, for messages that give a hint apart.
    pub fn without_hint(&self) -> impl std::fmt::Display + '_ {
        WithoutHint(self)
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (hint: {})", WithoutHint(self), self.hint())
    }
}

/// An error, shown without its hint.
struct WithoutHint<'a>(&'a Error);

impl std::fmt::Display for WithoutHint<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Details { code, section, offset, expected, found, path, .. } = &*self.0.0;
        // Where there are no files, the formatting of paths would be in the way.
        const HAS_FILES: bool = !cfg!(all(target_family = "wasm", target_os = "unknown"));
        if let Some(path) = path.as_ref().filter(|_| HAS_FILES) {
            write!(f, "{}: ", path.display())?;
        }
        write!(f, "{code}")?;
        // What separates a part of the text from the one before.
        let mut gap = ":";
        if let Some(Section { kind, object }) = *section {
            write!(f, "{gap} {}", kind::name(kind))?;
            if object != NONE {
                write!(f, " of object {object}")?;
            }
            gap = ",";
        }
        if let Some(offset) = offset {
            write!(f, "{gap} byte {offset}")?;
            gap = ":";
        }
        write!(f, "{gap} expected {expected}, found {found}")
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source.as_ref().map(|e| e as _)
    }
}

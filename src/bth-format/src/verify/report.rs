//! What a verified file holds.

/// Counts over a whole file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Objects.
    pub objects: u32,
    /// Sections whose hashes were compared.
    pub sections: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Triangles that can be hit.
    pub triangles: u64,
    /// Triangles of zero area.
    pub dropped: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Tetrahedra.
    pub tets: u64,
    /// Objects whose triangles were compared with kept positions of the source.
    pub compared_with_source: u32,
}

//! Typed rows of glTF accessors (glTF 2.0 specification, §3.6), with every access checked.

use glam::{DAffine3, DMat4};

use crate::error::{Error, Result};
use crate::gltf::buffer::Buffers;
use crate::gltf::schema::{Accessor, GltfDocument};
use crate::source::Source;

const ACCESSOR: &str = "BTH-I013";

/// Reads accessors of a document.
pub(crate) struct Accessors<'a> {
    pub(crate) source: &'a Source<'a>,
    pub(crate) document: &'a GltfDocument,
    pub(crate) buffers: Buffers<'a>,
}

/// Component types.
#[derive(Clone, Copy, PartialEq)]
enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl ComponentType {
    fn from_code(code: u64) -> Option<ComponentType> {
        Some(match code {
            5120 => ComponentType::I8,
            5121 => ComponentType::U8,
            5122 => ComponentType::I16,
            5123 => ComponentType::U16,
            5125 => ComponentType::U32,
            5126 => ComponentType::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            ComponentType::I8 | ComponentType::U8 => 1,
            ComponentType::I16 | ComponentType::U16 => 2,
            ComponentType::U32 | ComponentType::F32 => 4,
        }
    }

    /// The value of a component's bytes.
    #[inline]
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let value = match self {
            ComponentType::F32 => {
                let mut word = [0; 4];
                word.copy_from_slice(bytes);
                return f32::from_le_bytes(word);
            }
            ComponentType::I8 => f64::from(bytes[0] as i8),
            ComponentType::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => f64::from(self.integer(bytes)),
        };
        if normalized { self.normalized(value) } else { value as f32 }
    }

    /// The fraction that a normalized integer stands for (§3.6.2.2).
    #[inline]
    fn normalized(self, value: f64) -> f32 {
        let most = match self {
            ComponentType::I8 => 127.0,
            ComponentType::U8 => 255.0,
            ComponentType::I16 => 32767.0,
            ComponentType::U16 => 65535.0,
            ComponentType::U32 => 4294967295.0,
            ComponentType::F32 => 1.0,
        };
        (value / most).max(-1.0) as f32
    }

    #[inline]
    fn integer(self, bytes: &[u8]) -> u32 {
        bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
    }
}

/// Rows inside a buffer view.
struct Rows<'b> {
    bytes: &'b [u8],
    stride: usize,
    size: usize,
}

impl<'b> Rows<'b> {
    #[inline]
    fn get(&self, row: usize) -> &'b [u8] {
        &self.bytes[row * self.stride..][..self.size]
    }
}

impl Accessors<'_> {
    /// Rows of `N` numbers: VEC2, VEC3 or VEC4 of floats or (KHR_mesh_quantization) integers.
    pub(crate) fn vectors<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>> {
        let (accessor, component) = self.accessor(index, &format!("VEC{N}"))?;
        let size = component.size();
        let convert = |bytes: &[u8]| {
            let mut vector = [0.0; N];
            for (value, bytes) in vector.iter_mut().zip(bytes.chunks_exact(size)) {
                *value = component.float(bytes, accessor.normalized);
            }
            vector
        };
        self.rows(index, accessor, N * size, [0.0; N], convert)
    }

    /// Rows that a decoder gave for an accessor as plain numbers, brought to what the accessor means by them.
    pub(crate) fn decoded<const N: usize>(&self, index: usize, numbers: &[f32]) -> Result<Vec<[f32; N]>> {
        let (accessor, component) = self.accessor(index, &format!("VEC{N}"))?;
        let rows = numbers.as_chunks::<N>().0;
        if !accessor.normalized || component == ComponentType::F32 {
            return Ok(rows.to_vec());
        }
        Ok(rows.iter().map(|row| row.map(|x| component.normalized(f64::from(x)))).collect())
    }

    /// Matrices of 4×4, of which the last row counts as (0, 0, 0, 1).
    pub(crate) fn matrices(&self, index: usize) -> Result<Vec<DAffine3>> {
        let (accessor, component) = self.accessor(index, "MAT4")?;
        if component != ComponentType::F32 {
            return Err(self.error(index, "expected matrices of 32-bit floats"));
        }
        let convert = |bytes: &[u8]| {
            let mut columns = [0.0; 16];
            for (value, bytes) in columns.iter_mut().zip(bytes.chunks_exact(4)) {
                *value = f64::from(component.float(bytes, false));
            }
            DAffine3::from_mat4(DMat4::from_cols_array(&columns))
        };
        self.rows(index, accessor, 64, DAffine3::from_mat4(DMat4::ZERO), convert)
    }

    /// Rows of one number.
    pub(crate) fn scalars(&self, index: usize) -> Result<Vec<f32>> {
        let (accessor, component) = self.accessor(index, "SCALAR")?;
        let convert = |bytes: &[u8]| component.float(bytes, accessor.normalized);
        self.rows(index, accessor, component.size(), 0.0, convert)
    }

    /// Rows of one unsigned integer.
    pub(crate) fn indices(&self, index: usize) -> Result<Vec<u32>> {
        let (accessor, component) = self.accessor(index, "SCALAR")?;
        if !matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err(self.error(index, "expected unsigned integers as indices"));
        }
        self.rows(index, accessor, component.size(), 0, |bytes| component.integer(bytes))
    }

    /// Whether an accessor has bytes of its own: a compressed primitive's accessors have none.
    pub(crate) fn has_data(&self, index: usize) -> bool {
        self.document.accessors.get(index).is_none_or(|a| a.buffer_view.is_some() || a.sparse.is_some())
    }

    /// Number of rows that an accessor claims, not checked against its bytes.
    pub(crate) fn count(&self, index: usize) -> Result<u64> {
        let accessor = self.document.accessors.get(index);
        accessor.map(|a| a.count).ok_or_else(|| self.error(index, "it does not exist"))
    }

    fn accessor(&self, index: usize, shape: &str) -> Result<(&Accessor, ComponentType)> {
        let accessor =
            self.document.accessors.get(index).ok_or_else(|| self.error(index, "it does not exist"))?;
        if accessor.shape != shape {
            return Err(self.error(index, format!("expected {shape}, found {}", accessor.shape)));
        }
        let component = ComponentType::from_code(accessor.component_type).ok_or_else(|| {
            self.error(index, format!("unknown component type {}", accessor.component_type))
        })?;
        Ok((accessor, component))
    }

    fn rows<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        size: usize,
        zero: T,
        convert: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let rows = self.slice(index, view, accessor.byte_offset, accessor.count, size)?;
                (0..accessor.count as usize).map(|row| convert(rows.get(row))).collect()
            }
            // Without a view all is zero (§5.1), which takes no bytes of the file: the bytes that were read bound it.
            None => {
                let most = self.source.data.len() as u64 + self.buffers.bytes_read();
                if accessor.count > most {
                    let message = format!(
                        "{} rows without data are too many: the model may have up to {most}, one for each byte read",
                        accessor.count
                    );
                    return Err(self.error(index, message));
                }
                vec![zero; accessor.count as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let component = ComponentType::from_code(sparse.indices.component_type)
                .filter(|c| matches!(c, ComponentType::U8 | ComponentType::U16 | ComponentType::U32))
                .ok_or_else(|| self.error(index, "expected unsigned integers as sparse indices"))?;
            let (at, count) = (&sparse.indices, sparse.count);
            let places = self.slice(index, at.buffer_view, at.byte_offset, count, component.size())?;
            let news =
                self.slice(index, sparse.values.buffer_view, sparse.values.byte_offset, count, size)?;
            for row in 0..count as usize {
                let place = component.integer(places.get(row));
                let value = values.get_mut(place as usize).ok_or_else(|| {
                    self.error(
                        index,
                        format!("expected sparse indices below {}, found {place}", accessor.count),
                    )
                })?;
                *value = convert(news.get(row));
            }
        }
        Ok(values)
    }

    /// `count` rows of `size` bytes, checked to lie inside the view.
    fn slice(&self, index: usize, view: usize, offset: u64, count: u64, size: usize) -> Result<Rows<'_>> {
        let (bytes, stride) = self.buffers.view(view)?;
        let stride = stride.unwrap_or(size as u64);
        if stride < size as u64 {
            return Err(self.error(index, format!("a stride of {stride} bytes is less than a row of {size}")));
        }
        let last = count.saturating_sub(1).checked_mul(stride);
        let end =
            last.and_then(|n| n.checked_add(offset)?.checked_add(if count > 0 { size as u64 } else { 0 }));
        match end.filter(|end| *end <= bytes.len() as u64) {
            Some(_) => Ok(Rows { bytes: &bytes[offset as usize..], stride: stride as usize, size }),
            None => {
                let message = format!(
                    "{count} rows do not fit into buffer view {view}, which has {} bytes",
                    bytes.len()
                );
                Err(self.error(index, message))
            }
        }
    }

    fn error(&self, index: usize, message: impl Into<String>) -> Error {
        let part = format!("accessor {index}");
        self.source.error_in_part(ACCESSOR, part, message, "export the model again")
    }
}

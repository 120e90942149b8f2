//! Typed rows of glTF accessors (glTF 2.0 specification, §3.6), with every access checked.

use glam::{DAffine3, DMat4};

use crate::error::{Error, Result};
use crate::gltf::file::GltfFile;
use crate::gltf::schema::Accessor;

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
    /// Returns the type of a code, its bytes and the integer that means 1 if it is normalized.
    fn properties(self) -> (u64, usize, f64) {
        match self {
            ComponentType::I8 => (5120, 1, 127.0),
            ComponentType::U8 => (5121, 1, 255.0),
            ComponentType::I16 => (5122, 2, 32767.0),
            ComponentType::U16 => (5123, 2, 65535.0),
            ComponentType::U32 => (5125, 4, 4294967295.0),
            ComponentType::F32 => (5126, 4, 1.0),
        }
    }

    fn from_code(code: u64) -> Option<ComponentType> {
        use ComponentType::*;
        [I8, U8, I16, U16, U32, F32].into_iter().find(|kind| kind.properties().0 == code)
    }

    fn size(self) -> usize {
        self.properties().1
    }

    fn is_index(self) -> bool {
        matches!(self, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// Returns the value of a component's bytes.
    #[inline]
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let value = match self {
            ComponentType::F32 => return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            ComponentType::I8 => f64::from(bytes[0] as i8),
            ComponentType::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => f64::from(self.integer(bytes)),
        };
        if normalized { self.normalized(value) } else { value as f32 }
    }

    /// Returns the fraction that a normalized integer means (§3.6.2.2).
    #[inline]
    fn normalized(self, value: f64) -> f32 {
        (value / self.properties().2).max(-1.0) as f32
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

impl GltfFile<'_> {
    /// Reads rows of `N` numbers: VEC2, VEC3 or VEC4 of floats or integers (KHR_mesh_quantization).
    pub(super) fn vectors<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>> {
        self.numbers(index, &format!("VEC{N}"))
    }

    /// Brings rows that a decoder gave for an accessor as plain numbers to what the accessor means.
    pub(super) fn decoded<const N: usize>(&self, index: usize, numbers: &[f32]) -> Result<Vec<[f32; N]>> {
        let (accessor, component) = self.accessor(index, &format!("VEC{N}"))?;
        let rows = numbers.as_chunks::<N>().0;
        if !accessor.normalized || component == ComponentType::F32 {
            return Ok(rows.to_vec());
        }
        Ok(rows.iter().map(|row| row.map(|x| component.normalized(f64::from(x)))).collect())
    }

    /// Reads matrices of 4×4, whose last row counts as (0, 0, 0, 1).
    pub(super) fn matrices(&self, index: usize) -> Result<Vec<DAffine3>> {
        let (_, component) = self.accessor(index, "MAT4")?;
        if component != ComponentType::F32 {
            return Err(self.accessor_error(index, "expected matrices of 32-bit floats"));
        }
        let rows: Vec<[f32; 16]> = self.numbers(index, "MAT4")?;
        let matrix = |columns: &[f32; 16]| DMat4::from_cols_array(&columns.map(f64::from));
        Ok(rows.iter().map(|columns| DAffine3::from_mat4(matrix(columns))).collect())
    }

    /// Reads rows of one number.
    pub(super) fn scalars(&self, index: usize) -> Result<Vec<f32>> {
        Ok(self.numbers::<1>(index, "SCALAR")?.into_flattened())
    }

    /// Reads rows of one unsigned integer.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>> {
        let (accessor, component) = self.accessor(index, "SCALAR")?;
        if !component.is_index() {
            return Err(self.accessor_error(index, "expected unsigned integers as indices"));
        }
        self.rows(index, accessor, component.size(), |bytes| component.integer(bytes))
    }

    /// Returns true if an accessor has bytes: a compressed primitive's accessors have none.
    pub(super) fn has_data(&self, index: usize) -> bool {
        self.document.accessors.get(index).is_none_or(|a| a.buffer_view.is_some() || a.sparse.is_some())
    }

    /// Returns the number of rows that an accessor claims, not checked against its bytes.
    pub(super) fn count(&self, index: usize) -> Result<u64> {
        let accessor = self.document.accessors.get(index);
        accessor.map(|a| a.count).ok_or_else(|| self.accessor_error(index, "it does not exist"))
    }

    fn accessor(&self, index: usize, shape: &str) -> Result<(&Accessor, ComponentType)> {
        let error = |message: String| self.accessor_error(index, message);
        let accessor = self.document.accessors.get(index);
        let accessor = accessor.ok_or_else(|| error("it does not exist".to_owned()))?;
        if accessor.shape != shape {
            return Err(error(format!("expected {shape}, found {}", accessor.shape)));
        }
        let component = ComponentType::from_code(accessor.component_type)
            .ok_or_else(|| error(format!("unknown component type {}", accessor.component_type)))?;
        Ok((accessor, component))
    }

    /// Reads rows of `N` numbers of any type.
    fn numbers<const N: usize>(&self, index: usize, shape: &str) -> Result<Vec<[f32; N]>> {
        let (accessor, component) = self.accessor(index, shape)?;
        let size = component.size();
        let convert = |bytes: &[u8]| {
            let mut numbers = [0.0; N];
            for (value, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(size)) {
                *value = component.float(bytes, accessor.normalized);
            }
            numbers
        };
        self.rows(index, accessor, N * size, convert)
    }

    fn rows<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        size: usize,
        convert: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let error = |message: String| self.accessor_error(index, message);
        let count = accessor.count;
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let rows = self.slice(index, view, accessor.byte_offset, count, size)?;
                (0..count as usize).map(|row| convert(rows.get(row))).collect()
            }
            // Without a view all is zero (§5.1). That takes no bytes, so the bytes read bound it.
            None => {
                let max = self.bytes_read();
                if count > max {
                    return Err(error(format!(
                        "{count} rows without data are too many: the model may have up to {max}, \
                         one for each byte read"
                    )));
                }
                vec![convert(&[0; 64][..size]); count as usize]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let component = ComponentType::from_code(sparse.indices.component_type)
                .filter(|c| c.is_index())
                .ok_or_else(|| error("expected unsigned integers as sparse indices".to_owned()))?;
            let (places, news) = (&sparse.indices, &sparse.values);
            let places =
                self.slice(index, places.buffer_view, places.byte_offset, sparse.count, component.size())?;
            let news = self.slice(index, news.buffer_view, news.byte_offset, sparse.count, size)?;
            for row in 0..sparse.count as usize {
                let place = component.integer(places.get(row));
                let value = values.get_mut(place as usize);
                let outside = || error(format!("expected sparse indices below {count}, found {place}"));
                *value.ok_or_else(outside)? = convert(news.get(row));
            }
        }
        Ok(values)
    }

    /// Returns `count` rows of `size` bytes, checked to lie inside the view.
    fn slice(&self, index: usize, view: usize, offset: u64, count: u64, size: usize) -> Result<Rows<'_>> {
        let (bytes, stride) = self.view(view)?;
        let stride = stride.unwrap_or(size as u64);
        if stride < size as u64 {
            let message = format!("a stride of {stride} bytes is less than a row of {size}");
            return Err(self.accessor_error(index, message));
        }
        let last = count.saturating_sub(1).checked_mul(stride);
        let end =
            last.and_then(|n| n.checked_add(offset)?.checked_add(if count > 0 { size as u64 } else { 0 }));
        if end.is_some_and(|end| end <= bytes.len() as u64) {
            return Ok(Rows { bytes: &bytes[offset as usize..], stride: stride as usize, size });
        }
        let length = bytes.len();
        let message = format!("{count} rows do not fit into buffer view {view}, which has {length} bytes");
        Err(self.accessor_error(index, message))
    }

    fn accessor_error(&self, index: usize, message: impl Into<String>) -> Error {
        self.error("BTH-I013", format!("accessor {index}"), message)
    }
}

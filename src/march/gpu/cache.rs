//! Pipeline cache of the driver, in the user's cache folder.
//!
//! Compilation takes seconds on some drivers; with the cache it is paid once for each plan. A cache that is damaged,
//! belongs to another driver or cannot be written is no error: kernels are compiled again. lavapipe stores nothing
//! here, as Mesa has a cache of its own.

use crate::limits::{CACHE_FILE_MIB, read_file};
use crate::user_cache;
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};

/// The driver's pipeline cache and its file.
#[derive(Clone)]
pub(super) struct DriverCache {
    compiled: wgpu::PipelineCache,
    file: PathBuf,
}

impl DriverCache {
    /// The cache of a device in a folder, possibly empty; `None` where the device has no pipeline cache.
    #[expect(unsafe_code, reason = "justified at the block")]
    pub(super) fn open(device: &wgpu::Device, info: &wgpu::AdapterInfo, folder: &Path) -> Option<Self> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let file = folder.join(wgpu::util::pipeline_cache_key(info)?);
        let stored = read_file(&file, &CACHE_FILE_MIB).unwrap_or_default();
        let descriptor =
            wgpu::PipelineCacheDescriptor { label: Some("bondline"), data: without_checksum(&stored), fallback: true };
        // SAFETY: the data must come from wgpu. The file is written only by `save`, atomically, in a folder of the
        // user, with a checksum that detects damage; wgpu checks device and driver and starts with an empty cache if
        // they differ. Whoever forges the file could as well replace the driver.
        let compiled = unsafe { device.create_pipeline_cache(&descriptor) };
        Some(Self { compiled, file })
    }

    pub(super) fn compiled(&self) -> &wgpu::PipelineCache {
        &self.compiled
    }

    /// Write the cache if it changed. Errors are ignored.
    pub(super) fn save(&self) {
        let Some(stored) = self.compiled.get_data().map(|data| with_checksum(&data)) else { return };
        if !read_file(&self.file, &CACHE_FILE_MIB).is_ok_and(|before| before == stored) {
            let _ = user_cache::replace(&self.file, &stored);
        }
    }
}

/// Checksum against damage, which neither wgpu nor every driver checks. Another build may hash differently and then
/// starts with an empty cache.
fn checksum(data: &[u8]) -> [u8; 8] {
    let mut hasher = DefaultHasher::new();
    hasher.write(data);
    hasher.finish().to_le_bytes()
}

fn with_checksum(data: &[u8]) -> Vec<u8> {
    [&checksum(data), data].concat()
}

/// The data without the checksum; `None` where they are damaged.
fn without_checksum(stored: &[u8]) -> Option<&[u8]> {
    let (found, data) = stored.split_first_chunk()?;
    (*found == checksum(data)).then_some(data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_or_truncated_data_are_rejected() {
        let stored = with_checksum(b"compiled");
        assert_eq!(without_checksum(&stored), Some(&b"compiled"[..]));
        assert_eq!(without_checksum(&stored[..stored.len() - 1]), None);
        assert_eq!(without_checksum(&[]), None);
        for byte in 0..stored.len() {
            let mut flipped = stored.clone();
            flipped[byte] ^= 1;
            assert_eq!(without_checksum(&flipped), None, "byte {byte}");
        }
    }
}

//! Kernels that a driver compiled before, in the user's folder for caches.
//!
//! What compiling costs, seconds on some drivers, is then paid once for each plan. A cache that is damaged, of another driver or in a
//! folder that cannot be written is no error: kernels are compiled as they would be without. lavapipe keeps nothing here, as Mesa has
//! a cache of its own.

use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::{env, fs, process};

/// What a driver compiled, and the file it is kept in.
#[derive(Clone)]
pub(super) struct Cache {
    compiled: wgpu::PipelineCache,
    file: PathBuf,
}

/// The folder of the specification of the XDG base directories, which has relative paths ignored.
pub(super) fn folder() -> Option<PathBuf> {
    let of = |name| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    of("XDG_CACHE_HOME").or_else(|| Some(of("HOME")?.join(".cache"))).map(|caches| caches.join("bondline"))
}

impl Cache {
    /// What a folder keeps of a device, or nothing yet; `None` where the device has no such caches.
    #[expect(unsafe_code, reason = "argued at the block")]
    pub(super) fn open(device: &wgpu::Device, info: &wgpu::AdapterInfo, folder: &Path) -> Option<Self> {
        if !device.features().contains(wgpu::Features::PIPELINE_CACHE) {
            return None;
        }
        let file = folder.join(wgpu::util::pipeline_cache_key(info)?);
        let kept = fs::read(&file).unwrap_or_default();
        let descriptor =
            wgpu::PipelineCacheDescriptor { label: Some("bondline"), data: unsealed(&kept), fallback: true };
        // SAFETY: the data are to be wgpu's own. They come from a file that `keep` alone writes, whole or not at all, in a folder of the
        // user's who runs this, and under a seal that tells damage; wgpu holds their device and driver against those at hand, and starts
        // afresh where one is another's. Whoever forges that can as well replace the driver.
        let compiled = unsafe { device.create_pipeline_cache(&descriptor) };
        Some(Self { compiled, file })
    }

    pub(super) fn compiled(&self) -> &wgpu::PipelineCache {
        &self.compiled
    }

    /// Write what is new since it was read, beside the file first and then in its place, as other marches may be reading. A cache that
    /// cannot be kept is none.
    pub(super) fn keep(&self) {
        let Some(kept) = self.compiled.get_data().map(|data| sealed(&data)) else { return };
        if fs::read(&self.file).is_ok_and(|before| before == kept) {
            return;
        }
        let beside = self.file.with_extension(process::id().to_string());
        let folder = self.file.parent().unwrap_or(Path::new("."));
        let done = fs::create_dir_all(folder)
            .and_then(|()| fs::write(&beside, kept))
            .and_then(|()| fs::rename(&beside, &self.file));
        if done.is_err() {
            // Nothing may be there to remove.
            let _ = fs::remove_file(&beside);
        }
    }
}

/// What tells damage, which neither wgpu nor every driver looks for. Another build may hash otherwise, and then starts afresh.
fn seal(data: &[u8]) -> [u8; 8] {
    let mut hasher = DefaultHasher::new();
    hasher.write(data);
    hasher.finish().to_le_bytes()
}

fn sealed(data: &[u8]) -> Vec<u8> {
    [&seal(data), data].concat()
}

/// The data under a seal; `None` where they are damaged.
fn unsealed(kept: &[u8]) -> Option<&[u8]> {
    let (found, data) = kept.split_first_chunk()?;
    (*found == seal(data)).then_some(data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_with_a_bit_flipped_or_a_byte_short_are_not_taken() {
        let kept = sealed(b"compiled");
        assert_eq!(unsealed(&kept), Some(&b"compiled"[..]));
        assert_eq!(unsealed(&kept[..kept.len() - 1]), None);
        assert_eq!(unsealed(&[]), None);
        for byte in 0..kept.len() {
            let mut flipped = kept.clone();
            flipped[byte] ^= 1;
            assert_eq!(unsealed(&flipped), None, "byte {byte}");
        }
    }
}

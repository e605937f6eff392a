//! Selects and opens a GPU. Only Vulkan is used: GPU drivers and Mesa's software renderer support it.

use std::sync::{Arc, Mutex, PoisonError};

/// Reason why no GPU can be used.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
pub(crate) enum GpuError {
    /// The machine has none.
    #[error(
        "no Vulkan device is here: install the driver of this machine's GPU, or Mesa's software renderer \
         (Debian: apt-get install mesa-vulkan-drivers)"
    )]
    NoDevice,
    /// None has the requested name.
    #[error("no Vulkan device has {wanted:?} in its name; there is {}", names.join(", "))]
    NotNamed {
        /// Requested name.
        wanted: String,
        /// Names of the present devices.
        names: Vec<String>,
    },
    /// The device cannot be opened.
    #[error("the Vulkan device {name} cannot be used: {reason}")]
    Unusable {
        /// Name of the device.
        name: String,
        /// Message of the driver.
        reason: String,
    },
}

/// An open GPU.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// Name of the device, for people.
    pub(crate) name: String,
    /// Whether it is a software renderer.
    pub(crate) is_software: bool,
    /// Whether it smooths edges.
    pub(crate) smooths: bool,
    pub(crate) limits: wgpu::Limits,
    /// Errors of the driver since the last check.
    faults: Arc<Faults>,
}

/// Keeps the first error: others follow from it.
#[derive(Debug, Default)]
struct Faults(Mutex<Option<String>>);

impl Faults {
    fn put(&self, fault: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault);
    }

    fn take(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Samples per pixel with smoothed edges.
pub(crate) const SAMPLES: u32 = 4;

impl Gpu {
    /// Opens the GPU whose name has `wanted` in it, or the one that is likely the fastest.
    ///
    /// # Errors
    /// Returns an error if there is none of that kind, or its driver refuses.
    pub(crate) fn open(wanted: Option<&str>) -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
        let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
        if names.is_empty() {
            return Err(GpuError::NoDevice);
        }
        let index = chosen(&names, wanted);
        let not_named =
            || GpuError::NotNamed { wanted: wanted.unwrap_or_default().to_owned(), names: names.clone() };
        let adapter = index.and_then(|index| adapters.get(index)).ok_or_else(not_named)?;
        Self::of(adapter)
    }

    fn of(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        // All limits of the device: pictures and meshes are bounded by its memory, and not by the minimum
        // that WebGPU guarantees.
        let limits = adapter.limits();
        let opened = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("simd-camera"),
            required_limits: limits.clone(),
            ..wgpu::DeviceDescriptor::default()
        }));
        let (device, queue) = opened
            .map_err(|error| GpuError::Unusable { name: info.name.clone(), reason: error.to_string() })?;
        let faults = Arc::new(Faults::default());
        let (uncaptured, lost) = (Arc::clone(&faults), Arc::clone(&faults));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| uncaptured.put(sentence(&error))));
        device.set_device_lost_callback(move |_, reason| lost.put(format!("the GPU was lost: {reason}")));
        let smooths = [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Depth32Float]
            .iter()
            .all(|format| adapter.get_texture_format_features(*format).flags.sample_count_supported(SAMPLES));
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { device, queue, name: info.name, is_software, smooths, limits, faults })
    }

    /// Returns the error of the driver since the last check, if any.
    pub(crate) fn fault(&self) -> Option<String> {
        self.faults.take()
    }
}

/// Formats an error for people, on one line.
fn sentence(error: &wgpu::Error) -> String {
    match error {
        wgpu::Error::OutOfMemory { .. } => "the GPU has no memory left".to_owned(),
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            description.split_whitespace().collect::<Vec<_>>().join(" ")
        }
    }
}

/// Returns the index of the requested name; of the first one without a request.
fn chosen(names: &[String], wanted: Option<&str>) -> Option<usize> {
    let wanted = wanted.unwrap_or_default().to_lowercase();
    names.iter().position(|name| name.to_lowercase().contains(&wanted))
}

/// Returns the rank of a device type: the fastest is 0.
fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_named_by_a_part_of_its_name() {
        let names = ["NVIDIA L4".to_owned(), "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned()];
        assert_eq!(chosen(&names, None), Some(0));
        assert_eq!(chosen(&names, Some("LLVMpipe")), Some(1));
        assert_eq!(chosen(&names, Some("radeon")), None);
    }

    #[test]
    fn the_first_complaint_is_kept_until_it_is_read() {
        let faults = Faults::default();
        faults.put("first".to_owned());
        faults.put("second".to_owned());
        assert_eq!(faults.take().as_deref(), Some("first"));
        assert_eq!(faults.take(), None);
    }
}

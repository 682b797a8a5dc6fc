//! Compiles every kernel with a second WGSL compiler, Chromium's. It rejects barriers in non-uniform control flow
//! (WGSL, section "Uniformity"), which naga accepts.

use super::shaders::all;
use crate::browser::{console, result};
use crate::support::{Scratch, runs_all};
use bondline::march::Precision;
use bondline::march::gpu::{COOPERATIVE_THREADS, shader};
use bondline::plan::Plan;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// WebGPU on SwiftShader, Chromium's software adapter.
const FLAGS: [&str; 2] = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"];

/// Compiles each kernel, creates pipelines for the marked ones, and reports the errors of each.
const PAGE: &str = r#"<!DOCTYPE html>
<meta charset="utf-8"><title>kernels</title>
<script src="kernels.js"></script>
<script type="module">
  const report = { adapter: "", kernels: [] };
  try {
    const adapter = await navigator.gpu.requestAdapter();
    report.adapter = adapter.info.architecture;
    const { maxStorageBuffersPerShaderStage, maxComputeWorkgroupStorageSize } = adapter.limits;
    const requiredLimits = { maxStorageBuffersPerShaderStage, maxComputeWorkgroupStorageSize };
    const device = await adapter.requestDevice({ requiredLimits });
    for (const { name, text, pipeline } of KERNELS) {
      const began = performance.now();
      const module = device.createShaderModule({ code: text });
      const { messages } = await module.getCompilationInfo();
      const errors = messages.filter((message) => message.type === "error");
      const found = errors.map((error) => `${error.lineNum}:${error.linePos} ${error.message}`);
      const made = performance.now();
      if (pipeline && found.length === 0) {
        const compute = { module, entryPoint: "march" };
        await device.createComputePipelineAsync({ layout: "auto", compute })
          .catch((error) => found.push(error.message));
      }
      const done = performance.now();
      report.kernels.push({ name, errors: found, module_ms: made - began, pipeline_ms: done - made });
    }
  } catch (error) {
    report.kernels.push({ name: "the page", errors: [String(error)] });
  }
  console.log("SEEN " + JSON.stringify(report));
</script>
"#;

/// Kernels for which a pipeline is created, by case and threads a member: the smallest of each kind; with
/// `BONDLINE_ALL` every kernel. SwiftShader takes two to seven seconds for each; uniformity is checked when a module is
/// compiled.
const PIPELINES: [(&str, u32); 2] = [("slab", 1), ("slab", COOPERATIVE_THREADS)];

/// Kernels that need more workgroup memory than SwiftShader has. A device with so little marches them on one thread a
/// member.
const TOO_LARGE: [&str; 2] =
    ["tacot-conductivity on 32 threads, texels: false", "tacot-held on 32 threads, texels: false"];

/// A kernel's text by its name, and whether to create a pipeline.
type Kernels = BTreeMap<String, (String, bool)>;

/// The kernels of all cases in single precision: WGSL has no `f64`. Differentiated kernels have no text.
fn kernels() -> Kernels {
    let mut found = Kernels::new();
    for case in all() {
        for (texels, lanes) in [(false, 1), (true, 1), (false, COOPERATIVE_THREADS)] {
            let text = shader::kernel(&Plan::new(&case), Precision::F32, texels, lanes, shader::MARCH);
            if !found.values().any(|(known, _)| *known == text) {
                let is_piped = runs_all() || !texels && PIPELINES.contains(&(case.id(), lanes));
                found.insert(format!("{} on {lanes} threads, texels: {texels}", case.id()), (text, is_piped));
            }
        }
    }
    found
}

/// The errors of each kernel by its name.
fn errors(kernels: &Kernels) -> BTreeMap<String, Vec<String>> {
    let scratch = Scratch::new("webgpu");
    let entry =
        |(name, kernel): (&String, &(String, bool))| json!({ "name": name, "text": kernel.0, "pipeline": kernel.1 });
    let list: Vec<Value> = kernels.iter().map(entry).collect();
    scratch.write("kernels.js", format!("const KERNELS = {};", Value::from(list)));
    let page = scratch.write("page.html", PAGE);
    let (report, console) = result(console(&scratch, &page, &FLAGS));
    assert_eq!(report["adapter"], "swiftshader", "after {console:?}");
    let kernels = report["kernels"].as_array().expect("the page reports kernels");
    let found = |kernel: &Value| {
        let (name, errors) = (&kernel["name"], &kernel["errors"]);
        let errors = errors.as_array().into_iter().flatten().map(ToString::to_string).collect();
        (name.as_str().unwrap_or_default().to_owned(), errors)
    };
    kernels.iter().map(found).collect()
}

/// Each of the negative controls has a barrier in non-uniform control flow.
#[test]
fn chromium_compiles_every_kernel_and_rejects_barriers_in_non_uniform_control_flow() {
    let mut kernels = kernels();
    let valid: Vec<String> = kernels.keys().cloned().collect();
    let text = kernels.values().map(|(text, _)| text).find(|text| text.contains("workgroupBarrier"));
    let text = text.expect("one has barriers").clone();
    for (name, from, to) in [
        ("a return that depends on the member", "if own_member >= run.members", "if member >= run.members"),
        ("a return that depends on the steps of a member", "return workgroupUniformLoad(&done);", "return done;"),
        ("a barrier in a loop over cells", "        mass_fluxes[i] = carries * upward_flux;", "        synchronize();"),
    ] {
        let invalid = text.replacen(from, to, 1);
        assert_ne!(text, invalid, "nothing was changed: {from}");
        kernels.insert(name.to_owned(), (invalid, false));
    }
    let (valid_errors, invalid_errors): (Vec<_>, Vec<_>) =
        errors(&kernels).into_iter().partition(|(name, _)| valid.contains(name));
    assert_eq!((valid_errors.len(), invalid_errors.len()), (valid.len(), 3));
    let is_too_large = |error: &String| error.contains("total use of workgroup storage");
    let mut too_large = Vec::new();
    for (name, mut errors) in valid_errors {
        if errors.iter().any(is_too_large) {
            too_large.push(name.clone());
        }
        errors.retain(|error| !is_too_large(error));
        assert_eq!(errors, Vec::<String>::new(), "{name}");
    }
    let expected: Vec<String> = if runs_all() { TOO_LARGE.map(str::to_owned).into() } else { Vec::new() };
    assert_eq!(too_large, expected);
    for (name, errors) in invalid_errors {
        assert!(errors.iter().any(|error| error.contains("uniform control flow")), "{name} passed: {errors:?}");
    }
}

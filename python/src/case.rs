//! A case, with its open session.

use crate::errors;
use crate::question::{self, Answers};
use crate::work::Watch;
use bondline::session::fingerprint;
use bondline::session::{BackendOptions, Options, PlanCache};
use bondline::study::thermocouple_residuals::samples;
use bondline::{Ensemble, Session, Traces};
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pythonize::{depythonize, pythonize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Traces of members, and their peaks.
type TracesAndPeaks<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>);
/// The same with their derivatives.
type DerivedTracesAndPeaks<'py> = (Bound<'py, PyArray4<f64>>, Bound<'py, PyArray4<f64>>);

/// The options of a session: `backend`, `precision` and `device`.
#[derive(Clone)]
pub(crate) struct SessionOptions(pub(crate) BackendOptions);

impl<'py> FromPyObject<'_, 'py> for SessionOptions {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let options = depythonize(&given).map_err(|error| errors::OptionError::new_err(error.to_string()));
        options.map(Self)
    }
}

/// A session, and the options that it was opened with.
struct OpenSession {
    options: BackendOptions,
    watch: Watch,
    session: Session,
}

/// A validated case.
#[pyclass(frozen, module = "bondline._bondline")]
pub(crate) struct Case {
    case: bondline::Case,
    session: Mutex<Option<OpenSession>>,
}

impl Case {
    fn new(case: bondline::Case) -> Self {
        Self { case, session: Mutex::new(None) }
    }

    /// The case of the library.
    pub(crate) fn library_case(&self) -> &bondline::Case {
        &self.case
    }

    /// Runs `work` on a session with these options. The session stays open for the next call with the
    /// same options, unless the work was cancelled.
    pub(crate) fn with_session<T: Send>(
        &self,
        py: Python<'_>,
        options: BackendOptions,
        report: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&mut Session) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        let kept = py.detach(|| self.session.lock().unwrap_or_else(PoisonError::into_inner).take());
        let kept = kept.filter(|kept| kept.options == options);
        let watch = kept.as_ref().map_or_else(Watch::default, |kept| kept.watch.clone());
        let run = || {
            let mut open = match kept {
                Some(open) => open,
                None => {
                    let session = Session::open(self.case.clone(), &session_options(options.clone(), &watch))
                        .map_err(|error| errors::session_error(&error))?;
                    OpenSession { options, watch: watch.clone(), session }
                }
            };
            let result = work(&mut open.session);
            Ok::<_, PyErr>((open, result))
        };
        let (open, result) = watch.run(py, report, run)??;
        *self.session.lock().unwrap_or_else(PoisonError::into_inner) = Some(open);
        result
    }
}

/// The options of a session.
fn session_options(march: BackendOptions, watch: &Watch) -> Options {
    let progress = watch.clone();
    let mut options = Options::default()
        .cancel(&watch.cancel)
        .progress(move |now| progress.set(now))
        .command_line(bondline::command::run::command_line());
    options.march = march;
    options.plan_cache = PlanCache::of_user();
    options
}

/// The members of an array with a row for each.
fn ensemble(points: &PyReadonlyArray2<'_, f64>) -> PyResult<Ensemble> {
    let [_, factors] = points.as_array().shape()[..] else { unreachable!("two axes") };
    let values = points.as_array().iter().copied().collect::<Vec<f64>>();
    if let Some(place) = values.iter().position(|value| !value.is_finite()) {
        let (member, factor) = (place / factors.max(1), place % factors.max(1));
        return Err(PyValueError::new_err(format!(
            "points[{member}, {factor}] is {}: expected finite numbers",
            values[place]
        )));
    }
    Ok(Ensemble::from_values(factors, values))
}

#[pymethods]
impl Case {
    /// Reads a case, with pairs of a key and a value that replace those of its file.
    #[staticmethod]
    fn load(path: PathBuf, overrides: Vec<(String, String)>) -> PyResult<Self> {
        let case = bondline::Case::load_with(&path, &overrides).map_err(|error| errors::case_error(&error))?;
        Ok(Self::new(case))
    }

    /// Reads a case from the text of a case file, and the files that it names from memory.
    #[staticmethod]
    fn from_toml(
        text: &str,
        id: &str,
        files: BTreeMap<String, Vec<u8>>,
        overrides: Vec<(String, String)>,
    ) -> PyResult<Self> {
        let case = bondline::Case::from_toml_with(text, id, &files, &overrides);
        Ok(Self::new(case.map_err(|error| errors::case_error(&error))?))
    }

    /// The content of the case.
    fn content<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, &self.case)?)
    }

    /// Hash of the content, by which other processes know the case.
    fn fingerprint(&self) -> String {
        fingerprint(&self.case)
    }

    /// Paths of the files that the case was read from, and the SHA-256 of each; the case file is first.
    fn input_files(&self) -> Vec<(String, String)> {
        self.case.input_files().iter().map(|file| (file.path.clone(), file.sha256.clone())).collect()
    }

    /// What was not read, one line each.
    fn notes(&self) -> Vec<String> {
        self.case.unread_data().iter().map(ToString::to_string).collect()
    }

    /// Instants of the traces, s.
    #[pyo3(signature = (options, report=None))]
    fn instants_s<'py>(
        &self,
        py: Python<'py>,
        options: SessionOptions,
        report: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let instants = self
            .with_session(py, options.0.clone(), report.as_ref(), |session| Ok(session.plan().instants_s().to_vec()))?;
        Ok(instants.into_pyarray(py))
    }

    /// Temperatures of members, K: member × sensor × instant; and their peaks: member × sensor × temperature, K, and
    /// time, s. A member that fails has NaN.
    #[pyo3(signature = (points, options, report=None))]
    fn march<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        options: SessionOptions,
        report: Option<Bound<'py, PyAny>>,
    ) -> PyResult<TracesAndPeaks<'py>> {
        let members = ensemble(&points)?;
        let [sensors, instants] = self.with_session(py, options.0.clone(), report.as_ref(), |session| {
            Ok([session.case().sensors().len(), session.plan().instants_s().len()])
        })?;
        // NumPy asks for huge pages, without which the first writes into a large array take as long as marching a tenth
        // of a simple case.
        let empty = py.import("numpy")?.call_method1("empty", ([members.len(), sensors, instants],))?;
        let found = empty.cast_into::<PyArray3<f64>>()?;
        let mut writable = found.readwrite();
        let values = writable.as_slice_mut()?;
        let shape = [members.len(), sensors, 2];
        let peaks = self.with_session(py, options.0.clone(), report.as_ref(), move |session| {
            let mut peaks = Vec::new();
            let take = &mut |batch: &Traces| {
                let start = batch.first * sensors * instants;
                question::copy_temperatures(batch, &mut values[start..start + batch.temperatures_k.len()]);
                peaks.extend(question::peaks(batch));
            };
            session.march_with(&members, take).map_err(|error| errors::session_error(&error))?;
            Ok(peaks)
        })?;
        drop(writable);
        Ok((found, PyArray::from_vec(py, peaks).reshape(shape)?))
    }

    /// Peaks of members: member × sensor × temperature, K, and time, s. A member that fails has NaN.
    #[pyo3(signature = (points, options, report=None))]
    fn peaks<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        options: SessionOptions,
        report: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let members = ensemble(&points)?;
        let count = members.len();
        let (sensors, peaks) = self.with_session(py, options.0.clone(), report.as_ref(), move |session| {
            let mut peaks = Vec::new();
            let take = &mut |batch: &Traces| peaks.extend(question::peaks(batch));
            session.march_with(&members, take).map_err(|error| errors::session_error(&error))?;
            Ok((session.case().sensors().len(), peaks))
        })?;
        PyArray::from_vec(py, peaks).reshape([count, sensors, 2])
    }

    /// Temperatures and their exact derivatives: member × (1 + factor) × sensor × instant; and those of the peaks:
    /// member × (1 + factor) × sensor × temperature and time.
    #[pyo3(signature = (points, factors, options, report=None))]
    fn tangents<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
        factors: Vec<usize>,
        options: SessionOptions,
        report: Option<Bound<'py, PyAny>>,
    ) -> PyResult<DerivedTracesAndPeaks<'py>> {
        let members = ensemble(&points)?;
        let (count, width) = (members.len(), 1 + factors.len());
        let traces = self.with_session(py, options.0.clone(), report.as_ref(), move |session| {
            let traces = session.tangents(&members, &factors).map_err(|error| errors::session_error(&error))?;
            traces.ok_or_else(|| errors::DeviceError::new_err("the backend has no derivatives"))
        })?;
        let shape = [count, width, traces.sensors, traces.instants];
        let peaks = question::peaks(&traces).collect();
        let peaks = PyArray::from_vec(py, peaks).reshape([count, width, traces.sensors, 2])?;
        Ok((PyArray::from_vec(py, question::temperatures(traces)).reshape(shape)?, peaks))
    }

    /// The samples that are fitted: sensor, instant, measured temperature in K and standard deviation in K.
    #[pyo3(signature = (options, report=None))]
    fn samples(
        &self,
        py: Python<'_>,
        options: SessionOptions,
        report: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Vec<(usize, usize, f64, f64)>> {
        self.with_session(py, options.0.clone(), report.as_ref(), |session| {
            let all = samples(session.case(), session.plan()).into_iter().flatten();
            Ok(all.map(|sample| (sample.sensor, sample.instant, sample.measured_k, sample.sigma_k)).collect())
        })
    }

    /// Answers a question: its name, its options, and the options of the session.
    #[pyo3(signature = (name, question, options, keeps_members=false, report=None))]
    fn ask<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        question: &Bound<'py, PyAny>,
        options: SessionOptions,
        keeps_members: bool,
        report: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(Answers, Option<question::Members>)> {
        let question = question::question(self, name, question)?;
        question::ask(self, py, &question, options.0, keeps_members, report.as_ref())
    }
}

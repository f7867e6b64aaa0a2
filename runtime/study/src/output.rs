//! Result files: opened before the work begins, in place only when they are complete.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::StudyError;

/// A file that appears under its name when it is complete, and not at all otherwise.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    temporary: NamedTempFile,
}

impl OutputFile {
    /// Makes sure that `path` can be written, before time is spent on its contents.
    ///
    /// # Errors
    /// If it cannot.
    pub fn create(path: &Path) -> Result<Self, StudyError> {
        let refused = |reason: &str| {
            Err(StudyError::output(path)(std::io::Error::other(
                reason.to_owned(),
            )))
        };
        if path.is_dir() {
            return refused("it is a folder");
        }
        if path.file_name().is_none() {
            return refused("it has no file name");
        }
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".hroc-").suffix(".tmp");
        #[cfg(unix)]
        {
            // As any file, less what the umask takes; temporary files are private otherwise.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let temporary = builder
            .tempfile_in(folder)
            .map_err(StudyError::output(path))?;
        Ok(Self {
            path: path.into(),
            temporary,
        })
    }

    /// Writes the contents and puts the file in place.
    ///
    /// # Errors
    /// If the disk is full or the place was taken away.
    pub fn finish(mut self, contents: &[u8]) -> Result<(), StudyError> {
        self.temporary
            .write_all(contents)
            .map_err(StudyError::output(&self.path))?;
        match self.temporary.persist(&self.path) {
            Ok(_) => Ok(()),
            Err(error) => Err(StudyError::output(&self.path)(error.error)),
        }
    }
}

/// A folder that takes result files.
///
/// # Errors
/// If it cannot be made.
pub fn create_folder(path: &Path) -> Result<(), StudyError> {
    fs::create_dir_all(path).map_err(StudyError::output(path))?;
    // A file in it shows whether it can be written to.
    OutputFile::create(&path.join("probe")).map(drop)
}

/// The PNG file of `Rgba8UnormSrgb` texels, rows from the top.
pub fn png(texels: &[u8], [width, height]: [u32; 2]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().expect("a header into memory");
    writer
        .write_image_data(texels)
        .expect("as many texels as the header says");
    writer.finish().expect("the end of a file in memory");
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.json");
        let entries = || fs::read_dir(folder.path()).unwrap().count();
        drop(OutputFile::create(&path).unwrap());
        assert_eq!(entries(), 0);
        OutputFile::create(&path).unwrap().finish(b"one").unwrap();
        OutputFile::create(&path).unwrap().finish(b"two").unwrap();
        assert_eq!(
            (fs::read(&path).unwrap().as_slice(), entries()),
            (&b"two"[..], 1)
        );
    }

    #[test]
    fn places_that_cannot_be_written_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        for path in [
            folder.path().to_path_buf(),
            folder.path().join("none/x.json"),
            PathBuf::from("/"),
        ] {
            let error = OutputFile::create(&path).unwrap_err();
            assert!(error.to_string().contains("cannot write it"), "{error}");
        }
        let file = folder.path().join("file");
        fs::write(&file, b"").unwrap();
        assert!(create_folder(&file.join("dump")).is_err());
        create_folder(&folder.path().join("a/b")).unwrap();
    }

    #[test]
    fn a_png_reads_back() {
        let texels = (0..24).collect::<Vec<u8>>();
        let file = png(&texels, [3, 2]);
        let mut reader = png::Decoder::new(std::io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut back = vec![0; 24];
        let info = reader.next_frame(&mut back).unwrap();
        assert_eq!((info.width, info.height, back), (3, 2, texels));
    }
}

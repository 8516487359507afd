// The files that a command reads and writes, as its user names them. What would lose somebody's data or a run's
// results is refused before anything is opened: a name that is empty, an output that cannot be written, and an output
// that is an input or another output as well, whatever it is called there.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace shiftrig::cli {

struct NamedFile {
    std::string option;  // "--csv", "RECORDING"; or in words: "the scenario's model"
    std::string path;
};

enum class StandardOutput { no, yes };  // whether - stands for it

class Files {
  public:
    // Options whose values name files, from the value `first` on (--snapshot-at T FILE: 1).
    CLI::Option* read(CLI::Option* option);
    CLI::Option* written(CLI::Option* option, StandardOutput may_be = StandardOutput::no, int first = 0);

    // To be called once the command line is parsed, and again when more is known of what is read and written. Throws
    // CLI::ValidationError, or InputError for what cannot be written.
    void check(const std::vector<NamedFile>& also_read = {},
               const std::vector<NamedFile>& also_written = {}) const;

  private:
    struct Marked {
        const CLI::Option* option;
        int first;
    };
    static std::vector<NamedFile> named(const std::vector<Marked>& options);
    std::vector<Marked> read_, written_;
};

// Can what is written there be read again? Not from a pipe, a terminal, /dev/null.
bool keeps_what_is_written(const std::string& path);

// A file for the time being: beside `neighbour`, under a name that nobody has, gone with this object however that ends. Where
// `neighbour` is no file that has a place (a pipe, a device, a standard stream), in the folder for temporary files.
class PassingFile {
  public:
    PassingFile(const std::string& neighbour, const std::string& ending);
    PassingFile(const PassingFile&) = delete;
    PassingFile& operator=(const PassingFile&) = delete;
    ~PassingFile();
    const std::string& path() const noexcept { return path_; }

  private:
    std::string path_;
};

}  // namespace shiftrig::cli

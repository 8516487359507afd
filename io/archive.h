// Saving and restoring what changes while a run goes on. Each class has one function that names its
// changing members, used in both directions, so that the two cannot differ:
//
//     void Ramp::archive(io::Archive& a) { a(active_, since_); a(values_); }
//
//     io::Archive::save(rig, bytes);                                 // a snapshot
//     io::Archive::restore(bytes, rig);                              // back again
//
// The bytes are the members' own: they fit the program that wrote them (io/recording/snapshot.h checks).
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "io/input_error.h"

namespace shiftrig::io {

class Archive {
  public:
    // Replaces what is in `bytes`; allocates nothing where its capacity is enough.
    template <class Object>
    static void save(Object& object, std::vector<std::byte>& bytes) {
        bytes.clear();
        Archive archive;
        archive.to_ = &bytes;
        object.archive(archive);
    }
    // Throws InputError if the object needs more, fewer or other bytes.
    template <class Object>
    static void restore(std::span<const std::byte> bytes, Object& object) {
        Archive archive;
        archive.from_ = bytes;
        object.archive(archive);
        if (!archive.from_.empty()) archive.misfit();
    }

    bool restoring() const noexcept { return to_ == nullptr; }

    template <class... Members>
    void operator()(Members&... members) {
        (member(members), ...);
    }

  private:
    Archive() = default;

    template <class T>
    void member(T& value) {
        static_assert(std::is_trivially_copyable_v<T>,
                      "name the members of this class in an archive() of its own");
        raw(&value, sizeof value);
    }
    // Vectors keep their length: they are sized when the object is built.
    template <class T>
    void member(std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        std::size_t count = values.size();
        member(count);
        if (count != values.size()) misfit();
        if (count > 0) raw(values.data(), count * sizeof(T));
    }

    void raw(void* data, std::size_t size) {
        if (to_) {
            const auto* bytes = static_cast<const std::byte*>(data);
            to_->insert(to_->end(), bytes, bytes + size);
            return;
        }
        if (from_.size() < size) misfit();
        std::memcpy(data, from_.data(), size);
        from_ = from_.subspan(size);
    }
    [[noreturn]] static void misfit() {
        throw InputError("the snapshot was taken of another assembly: its parts do not fit");
    }

    std::vector<std::byte>* to_ = nullptr;
    std::span<const std::byte> from_;
};

}  // namespace shiftrig::io

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <iterator>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/state_file.h"
#include "innerspring/study/cases.h"

namespace innerspring {

namespace {

constexpr std::string_view magic = "innerspring study cases 2";

void add_series(std::string& text, const std::vector<double>& values) {
    text += fmt::format("\t{}", values.size());
    for (const double value : values) text += fmt::format(" {}", value);
}

/// Takes one line apart: the key to the first tab, then numbers.
class Fields {
  public:
    explicit Fields(std::string_view line) : rest_(line) {}

    std::string key() {
        const std::size_t tab = std::min(rest_.find('\t'), rest_.size());
        const std::string key(rest_.substr(0, tab));
        rest_.remove_prefix(tab);
        return key;
    }
    template <class Number>
    Number number() {
        Number value{};
        if (!rest_.empty()) rest_.remove_prefix(1);
        const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
        if (error != std::errc()) throw InputError("not a number");
        rest_.remove_prefix(std::size_t(end - rest_.data()));
        return value;
    }
    bool done() const { return rest_.empty(); }
    std::vector<double> series() {
        std::vector<double> values(std::min(number<std::size_t>(), rest_.size()));
        for (double& value : values) value = number<double>();
        return values;
    }

  private:
    std::string_view rest_;
};

}  // namespace

void write_table(const SeriesTable& table, std::string_view what, std::uint64_t hash,
                 const std::filesystem::path& file) {
    std::string text = fmt::format("{} {:016x}\n", what, hash);
    for (const auto& [key, rows] : table) {
        text += key;
        for (const std::vector<double>& row : rows) add_series(text, row);
        text += '\n';
    }
    text += fmt::format("check {:016x}\n", text_hash(text));
    write_whole(file, text);
}

SeriesTable read_table(std::string_view what, std::uint64_t hash, const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw InputError(fmt::format("{}: there are no saved cases to resume from", file.string()));
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (!text.starts_with(what))
        throw InputError(fmt::format("{}: not the cases of a study of this version", file.string()));
    const std::size_t check = text.rfind("check ");
    if (check == std::string::npos ||
        text.substr(check) !=
            fmt::format("check {:016x}\n", text_hash(std::string_view(text).substr(0, check))))
        throw InputError(fmt::format("{}: damaged (its checksum does not match)", file.string()));
    std::size_t begin = text.find('\n') + 1;
    if (text.substr(0, begin) != fmt::format("{} {:016x}\n", what, hash))
        throw InputError(fmt::format(
            "{}: cases of another study (mesh, material or settings differ); use the same ones, another "
            "folder, or leave --resume out",
            file.string()));
    SeriesTable table;
    for (std::size_t end; begin < check; begin = end + 1) {
        end = text.find('\n', begin);
        Fields fields(std::string_view(text).substr(begin, end - begin));
        auto& rows = table[fields.key()];
        while (!fields.done()) rows.push_back(fields.series());
    }
    return table;
}

void write_cases(const Responses& responses, std::uint64_t hash, const std::filesystem::path& file) {
    SeriesTable table;
    for (const auto& [key, r] : responses)
        table[key] = {{r.std_m, r.imbalance}, r.vertex_m, r.load_m,
                      r.volume_percent,       r.force_n,  r.pressure_pa};
    write_table(table, magic, hash, file);
}

Responses read_cases(const std::filesystem::path& file, std::uint64_t hash) {
    Responses responses;
    for (auto& [key, rows] : read_table(magic, hash, file))
        responses.emplace(
            key, Response{std::move(rows.at(1)), std::move(rows.at(2)), std::move(rows.at(3)),
                          rows.at(0).at(0), rows.at(0).at(1), std::move(rows.at(4)), std::move(rows.at(5))});
    return responses;
}

}  // namespace innerspring

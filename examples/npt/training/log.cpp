#include <training/log.hpp>

#include <render/plot.hpp>

#include <npt/base/error.hpp>
#include <npt/base/number_text.hpp>
#include <npt/base/platform.hpp>
#include <npt/io/file.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>

namespace training {

namespace {

constexpr std::string_view header =
    "step,seconds,progress,rate,loss,reconstruction,edge,train_pmd,gradient_norm,batch,vertices,data_share,"
    "validation_pmd";

/// The shortest text that reads back as the same number.
void add_number(std::string& line, auto value) {
  char text[32];
  line.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

std::string quoted(std::string_view text) { return std::string(1, '\'').append(text).append(1, '\''); }

std::string line_of(const LogRow& r) {
  std::string line;
  const auto add = [&line](auto value) {
    if (!line.empty()) line += ',';
    add_number(line, value);
  };
  add(r.step);
  for (const double v : {r.seconds, r.progress, r.rate, r.loss, r.reconstruction, r.edge, r.pmd, r.gradient_norm})
    add(v);
  add(r.batch);
  add(r.vertices);
  add(r.data_share);
  line += ',';
  if (r.validation_pmd) add_number(line, *r.validation_pmd);
  return line + '\n';
}

/// Reads the fields of a line one after another.
class Fields {
 public:
  Fields(std::string_view line, const std::string& file, std::size_t number)
      : rest_(line), file_(file), number_(number) {}

  template <class T>
  void read(T& value) {
    const std::string_view field = next();
    const auto result = npt::number_from_chars(field.data(), field.data() + field.size(), value);
    if (result.ec != std::errc() || result.ptr != field.data() + field.size()) fail(quoted(field), "a number");
  }
  void read(std::optional<double>& value) {
    if (rest_.empty() && !ended_)
      next();
    else
      read(value.emplace());
  }
  void end() const {
    if (!ended_) fail(quoted(rest_), "the end of the line");
  }

 private:
  std::string_view next() {
    if (ended_) fail("the end of the line", "13 fields");
    const std::size_t comma = rest_.find(',');
    const std::string_view field = rest_.substr(0, comma);
    ended_ = comma == std::string_view::npos;
    rest_ = ended_ ? std::string_view() : rest_.substr(comma + 1);
    return field;
  }
  [[noreturn]] void fail(std::string found, std::string expected) const {
    throw npt::Error({file_, "line " + std::to_string(number_), std::move(found), std::move(expected)});
  }

  std::string_view rest_;
  const std::string& file_;
  std::size_t number_;
  bool ended_ = false;
};

}  // namespace

std::vector<LogRow> read_log(const std::filesystem::path& path) {
  const std::string name = path.string(), text = npt::read_file(path);
  std::vector<LogRow> rows;
  std::size_t number = 0;
  for (std::size_t begin = 0;; ++number) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    if (number == 0) {
      if (line != header) throw npt::Error({name, "line 1", quoted(line.substr(0, 40)), "the log of a training"});
      continue;
    }
    Fields fields(line, name, number + 1);
    LogRow& r = rows.emplace_back();
    fields.read(r.step);
    for (double* v : {&r.seconds, &r.progress, &r.rate, &r.loss, &r.reconstruction, &r.edge, &r.pmd, &r.gradient_norm})
      fields.read(*v);
    fields.read(r.batch);
    fields.read(r.vertices);
    fields.read(r.data_share);
    fields.read(r.validation_pmd);
    fields.end();
  }
  if (number == 0) throw npt::Error({name, {}, "no complete line", "the log of a training"});
  return rows;
}

Log::Log(std::filesystem::path path, std::optional<std::uint64_t> resumed_step) : path_(std::move(path)) {
  std::string text = std::string(header) + '\n';
  std::error_code code;
  if (resumed_step && std::filesystem::exists(path_, code))
    for (const LogRow& row : read_log(path_))
      if (row.step <= *resumed_step) text += line_of(row);
  npt::write_file(path_, text);
}

void Log::append(const LogRow& row) {
  const auto fail = [this] {
    throw npt::Error({path_.string(), {}, std::strerror(errno), "a file that can be written"});
  };
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file(npt::platform::open_file(path_, "ab"));
  if (!file) fail();
  const std::string line = line_of(row);
  if (std::fwrite(line.data(), 1, line.size(), file.get()) != line.size() || std::fflush(file.get()) != 0) fail();
}

render::Image plot_log(std::span<const LogRow> rows, const std::string& title) {
  render::Series samples{
      .name = "training samples", .x = {}, .y = {}, .colour = render::from_hex(0x9DB7D5), .width = 2};
  render::Series validation{.name = "unseen identities and poses",
                            .x = {},
                            .y = {},
                            .colour = render::from_hex(0xB4262F),
                            .width = 2,
                            .markers = true};
  const double last = rows.empty() ? 0 : rows.back().seconds;
  const double unit = last > 3 * 3600 ? 3600 : last > 180 ? 60 : 1;
  for (const LogRow& row : rows) {
    samples.x.push_back(row.seconds / unit);
    samples.y.push_back(1e4 * row.pmd);
    if (!row.validation_pmd) continue;
    validation.x.push_back(row.seconds / unit);
    validation.y.push_back(1e4 * *row.validation_pmd);
  }
  const render::Series series[] = {std::move(samples), std::move(validation)};
  render::PlotOptions options;
  options.title = title;
  options.x_label = unit == 3600 ? "hours of training" : unit == 60 ? "minutes of training" : "seconds of training";
  options.y_label = "PMD, 1e-4 square metres";
  options.log_x = options.log_y = true;
  return render::draw_plot(series, options);
}

}  // namespace training

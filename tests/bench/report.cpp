#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>

#include "common/plot/chart.h"
#include "common/plot/table.h"
#include "tests/bench/register.h"

namespace gatefield::bench {
namespace {

using plot::Cell;
using plot::Table;

/// One benchmark's medians over its repetitions (or its only run).
struct Entry {
  std::map<std::string, double> numbers;
  double ms(const char* field = "cpu_time") const { return number(field) * scale; }
  double number(const std::string& field) const {
    const auto found = numbers.find(field);
    return found == numbers.end() ? std::nan("") : found->second;
  }
  double scale = 1.0;  ///< of its time unit, in ms
};
using Results = std::map<std::string, Entry>;

struct Machine {
  std::string date, cores, mhz, load;
};

bool read(const std::string& file, Results* results, Machine* machine) {
  std::ifstream in(file);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  google::protobuf::Struct root;
  if (!in || !google::protobuf::util::JsonStringToMessage(text, &root).ok()) {
    std::cerr << "gatefield-bench: " << file << " can't be read or is no JSON, expected what --benchmark_out writes\n";
    return false;
  }
  const auto& fields = root.fields();
  if (const auto context = fields.find("context"); context != fields.end()) {
    const auto& about = context->second.struct_value().fields();
    const auto show = [&](const char* name) {
      const auto value = about.find(name);
      if (value == about.end()) return std::string();
      if (value->second.has_string_value()) return value->second.string_value();
      if (value->second.has_number_value()) return std::to_string(std::lround(value->second.number_value()));
      std::string list;
      for (const auto& item : value->second.list_value().values()) {
        char number[32];
        std::snprintf(number, sizeof number, "%s%.1f", list.empty() ? "" : ", ", item.number_value());
        list += number;
      }
      return list;
    };
    if (!show("num_cpus").empty()) *machine = {show("date"), show("num_cpus"), show("mhz_per_cpu"), show("load_avg")};
  }
  const auto list = fields.find("benchmarks");
  if (list == fields.end()) return true;
  for (const auto& item : list->second.list_value().values()) {
    const auto& values = item.struct_value().fields();
    const auto word = [&](const char* name) {
      const auto value = values.find(name);
      return value == values.end() ? std::string() : value->second.string_value();
    };
    if (!word("error_message").empty()) continue;
    const std::string aggregate = word("aggregate_name");
    if (!aggregate.empty() && aggregate != "median") continue;
    std::string name = word("run_name").empty() ? word("name") : word("run_name");
    for (const char* part : {"/manual_time", "/real_time", "/iterations:100", "/iterations:1", "/min_time:0.400"})
      if (const std::size_t at = name.find(part); at != std::string::npos) name.erase(at, std::string(part).size());
    Entry entry;
    for (const auto& [field, value] : values)
      if (value.has_number_value()) entry.numbers[field] = value.number_value();
    const std::string unit = word("time_unit");
    entry.scale = unit == "us" ? 1e-3 : unit == "ns" ? 1e-6 : unit == "s" ? 1e3 : 1.0;
    (*results)[name] = entry;
  }
  return true;
}

const Entry* find(const Results& results, const std::string& name) {
  const auto found = results.find(name);
  return found == results.end() ? nullptr : &found->second;
}

std::string step_name(const std::string& what, int samples, int steps, int threads, const std::string& isa, bool all) {
  return "step/" + what + "/M=" + std::to_string(samples) + "/K=" + std::to_string(steps) +
         "/threads=" + std::to_string(threads) + "/" + isa + (all ? "/all_decoded" : "");
}

Cell ms_cell(const Entry* entry, const char* field) { return {entry ? entry->number(field) : std::nan(""), 2}; }

class Report {
 public:
  Report(Results results, std::filesystem::path folder) : results_(std::move(results)), folder_(std::move(folder)) {
    for (const char* isa : {"avx3", "avx2", "neon", "sse4", "scalar", "emu128"}) {
      if (best_.empty() && find(results_, step_name("race/race", 2048, 20, 1, isa, false))) best_ = isa;
    }
  }

  std::string text(const Machine& machine, const std::string& note) {
    out_ << "# Performance\n\nMade by `deploy/bench` from what `gatefield-bench` measured; every number below is a "
            "median over repetitions in one run on one machine.\n\n"
         << "Machine: " << machine.cores << " cores at nominally " << machine.mhz << " MHz, " << machine.date
         << ", load average " << machine.load << ". Instruction set of the planner: " << best_ << ".\n\n";
    if (!note.empty()) out_ << note << "\n\n";
    out_
        << "Kernels, decoders, frames and steps on one core are that thread's CPU time, which does not count what else "
           "ran; steps on two cores, vehicles and the wire are wall-clock time.\n";
    peaks();
    decoders();
    kernels();
    steps();
    others();
    return out_.str();
  }

 private:
  /// Columns that nothing was measured for are left out.
  void table(Table table) {
    for (std::size_t column = table.columns.size(); column-- > 0;) {
      const bool empty = std::all_of(table.rows.begin(), table.rows.end(),
                                     [column](const auto& row) { return row[column].text == "-"; });
      if (!empty) continue;
      table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(column));
      for (auto& row : table.rows) row.erase(row.begin() + static_cast<std::ptrdiff_t>(column));
    }
    if (!table.rows.empty()) out_ << "\n" << plot::to_markdown(table);
  }
  void picture(const plot::Chart& chart, const std::string& name, const std::string& alt) {
    const auto drawn = plot::draw(chart, folder_ / "performance", name);
    if (!drawn) {
      std::cerr << "gatefield-bench: " << drawn.error() << "\n";
      return;
    }
    if (drawn.value().png)
      out_ << "\n![" << alt << "](performance/" << name << ".png)\n";
    else
      std::cerr << "gatefield-bench: " << drawn.value().why_not << "\n";
  }

  void peaks() {
    out_ << "\n## What one core can do at best\n\nMultiply-adds on registers alone. An AMX unit is not among them "
            "unless "
            "listed: the times that were asked for AMX (a peak of 1400 GMAC/s a core) hold in proportion.\n";
    Table t;
    t.columns = {"instructions", "GMAC/s"};
    for (const char* isa : {"avx3_bf16", "avx3_int16", "avx3", "avx2"}) {
      if (const Entry* e = find(results_, std::string("peak/") + isa)) {
        peak_[isa] = e->number("MAC/s");
        t.rows.push_back({isa, {peak_[isa] * 1e-9, 0}});
      }
    }
    table(t);
  }

  void decoders() {
    out_ << "\n## Field decoder, 163,840 queries, one core\n\nThe shipped decoders with the latent of a gate; ours "
            "transforms and encodes the points itself, the libraries get them encoded. Error: the largest difference "
            "from a double-precision evaluation over 2000 points.\n";
    for (const char* model : {"race", "paper"}) {
      const std::string prefix = std::string("decoder/") + model + "/";
      double library = std::nan("");
      std::vector<std::pair<double, std::string>> order;
      for (const auto& [name, entry] : results_) {
        if (name.rfind(prefix, 0) != 0) continue;
        const std::string who = name.substr(prefix.size());
        order.emplace_back(entry.ms(), who);
        if (who.rfind("ours", 0) != 0 && !(library < entry.ms())) library = entry.ms();
      }
      std::sort(order.begin(), order.end());
      Table t;
      t.title = std::string("Decoder of model `") + model + "`";
      t.columns = {"who", "ms", "GMAC/s", "of its peak, %", "times the best library", "error, mm"};
      plot::Chart chart;
      chart.title = t.title;
      chart.y = {"163,840 queries on one core", "ms"};
      chart.series = {{}};
      chart.series[0].style = plot::Style::kBars;
      for (const auto& [ms, who] : order) {
        const Entry& entry = results_.at(prefix + who);
        const std::string isa = who.rfind("ours_", 0) == 0                                             ? who.substr(5)
                                : who.find("bf16") != std::string::npos && peak_.contains("avx3_bf16") ? "avx3_bf16"
                                                                                                       : best_;
        const auto peak = peak_.find(isa);
        t.rows.push_back({who,
                          {ms, 2},
                          {entry.number("MAC/s") * 1e-9, 1},
                          {peak == peak_.end() ? std::nan("") : 100.0 * entry.number("MAC/s") / peak->second, 0},
                          {library / ms, 2},
                          {1e3 * entry.number("worst_m"), 3}});
        chart.x.ticks.emplace_back(static_cast<double>(chart.series[0].x.size()), who);
        chart.series[0].x.push_back(static_cast<double>(chart.series[0].x.size()));
        chart.series[0].y.push_back(ms);
      }
      if (order.empty()) continue;
      table(t);
      chart.y.low = 0.0;
      chart.width_px = 1200;
      picture(chart, std::string("decoder-") + model, t.title + ": milliseconds by library and instruction set");
    }
  }

  void kernels() {
    out_ << "\n## The rest of a step, one core\n";
    for (const int samples : {2048, 8192}) {
      Table t;
      t.title = "M = " + std::to_string(samples) + ", K = 20, ms";
      t.columns = {"instruction set", "noise", "rollout", "temperature and weights", "average"};
      for (const char* isa : {"avx3", "avx2", "neon", "sse4", "scalar", "emu128"}) {
        const auto at = [&](const char* kernel) {
          const Entry* e =
              find(results_, std::string("kernel/") + kernel + "/M=" + std::to_string(samples) + "/" + isa);
          return e ? e->ms() : std::nan("");
        };
        if (std::isnan(at("noise"))) continue;
        t.rows.push_back(
            {isa, {at("noise"), 3}, {at("rollout"), 3}, {at("temperature_and_weights"), 3}, {at("average"), 3}});
      }
      table(t);
    }
  }

  void steps() {
    out_ << "\n## A whole step\n\nInputs are those of a flight around six gates with the shipped model "
            "(tests/bench/flight.h). `decoded` is the part of the rollouts for which the field was asked: the others "
            "could no longer get weight (server/planner/planner.h says why the plan is the same), `all decoded` asks "
            "for every one.\n";
    plot::Chart chart;
    chart.title = "A step of the race profile, K = 20";
    chart.x = {"rollouts M", "", true};
    chart.y = {"step, median", "ms", true};
    chart.key = plot::Key::kTopLeft;
    for (const char* what : {"race/race", "paper/race", "paper/paper"}) {
      Table t;
      const std::string model = std::string(what).substr(0, 5) == "race/" ? "race" : "paper";
      t.title = "Model `" + model + "`, profile `" + std::string(what).substr(model.size() + 1) + "`, K = 20, ms";
      t.columns = {"M",
                   "one core",
                   "p99",
                   "two cores",
                   "p99",
                   "decoded, %",
                   "all decoded, one core",
                   "two cores",
                   "gain of leaving out, one core"};
      std::map<std::string, plot::Series> curves;
      for (const int samples : {512, 1024, 2048, 4096, 8192, 16384}) {
        const auto at = [&](int threads, bool all) {
          return find(results_, step_name(what, samples, 20, threads, best_, all));
        };
        const Entry *one = at(1, false), *two = at(2, false), *one_all = at(1, true), *two_all = at(2, true);
        if (!one) continue;
        t.rows.push_back({{double(samples), 0},
                          ms_cell(one, "p50_ms"),
                          ms_cell(one, "p99_ms"),
                          ms_cell(two, "p50_ms"),
                          ms_cell(two, "p99_ms"),
                          {100.0 * one->number("decoded"), 1},
                          ms_cell(one_all, "p50_ms"),
                          ms_cell(two_all, "p50_ms"),
                          {one_all ? one_all->number("p50_ms") / one->number("p50_ms") : std::nan(""), 2}});
        for (const auto& [name, entry] :
             {std::pair{"1 one core", one}, std::pair{"2 two cores", two},
              std::pair{"3 one core, all decoded", one_all}, std::pair{"4 two cores, all decoded", two_all}}) {
          if (!entry) continue;
          plot::Series& curve = curves[name];
          curve.name = name + 2;
          curve.style = plot::Style::kLinePoints;
          curve.x.push_back(samples);
          curve.y.push_back(entry->number("p50_ms"));
        }
      }
      table(t);
      if (chart.series.empty())
        for (const auto& [name, curve] : curves) chart.series.push_back(curve);
    }
    if (!chart.series.empty()) picture(chart, "step", "Milliseconds of a step over the number of rollouts");

    Table t;
    t.title = "How a step grows with K, and by instruction set (model and profile `race`, M = 2048, one core, ms)";
    t.columns = {"K", "instruction set", "step", "all decoded"};
    const auto row = [&](int samples, int steps, const std::string& isa) {
      const Entry* e = find(results_, step_name("race/race", samples, steps, 1, isa, false));
      if (e)
        t.rows.push_back({{double(steps), 0},
                          isa,
                          ms_cell(e, "p50_ms"),
                          ms_cell(find(results_, step_name("race/race", samples, steps, 1, isa, true)), "p50_ms")});
    };
    for (const int steps_k : {10, 20, 30, 40}) row(2048, steps_k, best_);
    for (const char* isa : {"avx3_int16", "avx2", "neon", "sse4", "scalar", "emu128"})
      if (best_ != isa) row(2048, 20, isa);
    table(t);
  }

  void others() {
    Table frames;
    frames.title = "A depth frame to a latent, one core";
    frames.columns = {"model and look", "ms"};
    Table vehicles;
    vehicles.title = "Vehicles at 50 Hz, M = 1024, two control threads, three seconds";
    vehicles.columns = {"vehicles", "deadlines met, %", "commands/s", "mean solve time, ms"};
    Table wire;
    wire.title = "State in to command out over DDS on one host";
    wire.columns = {"what",        "p50, us",      "p99, us", "p99.9, us", "its step, p50", "beyond its step: p50",
                    "beyond: p99", "beyond: p99.9"};
    Table fleet;
    fleet.title = "Vehicles at 50 Hz over the wire, M = 1024, gatefield-server with two control threads";
    fleet.columns = {"vehicles",
                     "control threads",
                     "ticks",
                     "in time, %",
                     "a step, ms",
                     "cores that the server took",
                     "cores that the vehicles' own process took"};
    std::map<int, const Entry*> by_count;
    std::map<std::pair<bool, int>, std::vector<Cell>> fleet_rows;
    for (const auto& [name, e] : results_) {
      if (name.rfind("frame/", 0) == 0) frames.rows.push_back({name.substr(6), {e.ms(), 2}});
      if (name.rfind("dds/", 0) == 0)
        wire.rows.push_back({name.substr(4),
                             {e.number("p50_us"), 0},
                             {e.number("p99_us"), 0},
                             {e.number("p999_us"), 0},
                             {e.number("step_p50_us"), 0},
                             {e.number("beyond_p50_us"), 0},
                             {e.number("beyond_p99_us"), 0},
                             {e.number("beyond_p999_us"), 0}});
      if (name.rfind("fleet/", 0) == 0) {
        const bool realtime = name.find("/realtime") != std::string::npos;
        fleet_rows[{realtime, std::atoi(name.c_str() + 6)}] = {{double(std::atoi(name.c_str() + 6)), 0},
                                                               realtime ? "SCHED_FIFO (--realtime)" : "as any other",
                                                               {e.number("ticks"), 0},
                                                               {e.number("met_percent"), 3},
                                                               {e.number("step_ms"), 2},
                                                               {e.number("server_cores"), 2},
                                                               {e.number("vehicles_cores"), 2}};
      }
      if (name.rfind("vehicles/M=1024/", 0) == 0) by_count[std::atoi(name.c_str() + 16)] = &e;
    }
    for (const auto& [count, e] : by_count)
      vehicles.rows.push_back(
          {{double(count), 0}, {e->number("met_percent"), 2}, {e->number("commands/s"), 0}, {e->ms("real_time"), 2}});
    for (const auto& [key, row] : fleet_rows) fleet.rows.push_back(row);
    out_ << "\n## Frames, vehicles, the wire\n";
    table(frames);
    if (!vehicles.rows.empty())
      out_ << "\nControl alone: the threads that make the steps, with states from one more thread of the same process "
              "(a "
              "few microseconds each), without frames and without a wire.\n";
    table(vehicles);
    if (!fleet.rows.empty())
      out_ << "\nThe whole server, over UDP on the loopback: states at 100 Hz and depth frames at 30 Hz of each "
              "vehicle. All "
              "vehicles live in one process on the same cores and compete with the server for them; its part is told. "
              "A tick is in time when its command left before the next one, as the server counts it.\n";
    table(fleet);
    if (!wire.rows.empty())
      out_ << "\n`Beyond its step` is each answer's round trip less the time that the server needed to plan this very "
              "answer.\n";
    table(wire);
  }

  Results results_;
  std::filesystem::path folder_;
  std::string best_;
  std::map<std::string, double> peak_;
  std::ostringstream out_;
};

}  // namespace

int report(const std::vector<std::string>& files, const std::string& folder) {
  Results results;
  Machine machine;
  std::string note;
  for (const std::string& file : files) {
    if (file.rfind("--note=", 0) == 0)
      note = file.substr(7);
    else if (!read(file, &results, &machine))
      return 2;
  }
  std::error_code failed;
  std::filesystem::create_directories(std::filesystem::path(folder) / "performance", failed);
  // What people have to say about the run, between head and tables: a file of theirs that is never written here.
  std::ifstream said(std::filesystem::path(folder) / "performance" / "conditions.md");
  std::string conditions((std::istreambuf_iterator<char>(said)), {});
  while (!conditions.empty() && conditions.back() == '\n') conditions.pop_back();
  if (!note.empty()) conditions += (conditions.empty() ? "" : "\n\n") + note;
  const std::string text = Report(std::move(results), folder).text(machine, conditions);
  std::ofstream out(std::filesystem::path(folder) / "performance.md");
  out << text;
  if (!out.flush()) {
    std::cerr << "gatefield-bench: " << folder << "/performance.md can't be written\n";
    return 2;
  }
  std::cout << "written: " << folder << "/performance.md\n";
  return 0;
}

}  // namespace gatefield::bench

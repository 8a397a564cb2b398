// gatefield-bench: how fast the server's parts are on this machine.
//   gatefield-bench [Google Benchmark's options, such as --benchmark_filter=decoder or --benchmark_out=FILE]
//   gatefield-bench report FOLDER RESULTS.json ...

#include <benchmark/benchmark.h>

#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include "tests/bench/register.h"

int main(int argc, char** argv) {
  using namespace gatefield;
  if (argc > 1 && std::strcmp(argv[1], "report") == 0) {
    if (argc < 4) {
      std::cerr << "gatefield-bench: report wants a folder and one file of results at least\n";
      return 2;
    }
    return bench::report({argv + 3, argv + argc}, argv[2]);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  bench::register_peaks();
  bench::register_kernels();
  bench::register_decoders();
  bench::register_encoders();
  bench::register_steps();
  bench::register_vehicles();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

#include "host/host.hpp"

#if defined(_WIN32)

#define WIN32_LEAN_AND_MEAN
#if !defined(NOMINMAX)  // libstdc++ defines it
#define NOMINMAX
#endif
#include <windows.h>
// After windows.h.
#include <psapi.h>
#include <shellapi.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cwchar>
#include <exception>
#include <iostream>
#include <string_view>
#include <system_error>
#include <thread>

#if defined(__MINGW32__)
/// libstdc++ makes wide names of `std::string` by this function, and Microsoft's old C library has none for UTF-8: this
/// one takes its place in the program. A character beyond 16 bits takes two calls; the second one's is kept in `state`.
extern "C" std::size_t mbrtowc(wchar_t* to, const char* from, std::size_t size, std::mbstate_t* state) {
  static std::mbstate_t own_state{};
  std::mbstate_t& pending = state != nullptr ? *state : own_state;
  constexpr auto incomplete = static_cast<std::size_t>(-2), wrong = static_cast<std::size_t>(-1);
  if (from == nullptr) {
    pending = {};
    return 0;
  }
  const auto give = [to](std::uint32_t word) {
    if (to != nullptr) *to = static_cast<wchar_t>(word);
  };
  if (pending != 0) {
    give(static_cast<std::uint32_t>(pending));
    pending = {};
    return 3;  // the bytes behind the first one, which the call before took
  }
  if (size == 0) return incomplete;
  const auto byte = [from](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(from[i])}; };
  const std::size_t length = byte(0) < 0x80           ? 1
                             : (byte(0) >> 5) == 0x06 ? 2
                             : (byte(0) >> 4) == 0x0E ? 3
                             : (byte(0) >> 3) == 0x1E ? 4
                                                      : 0;
  if (length == 0) {
    errno = EILSEQ;
    return wrong;
  }
  if (size < length) return incomplete;
  std::uint32_t character = length == 1 ? byte(0) : byte(0) & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) {
      errno = EILSEQ;
      return wrong;
    }
    character = character << 6 | (byte(i) & 0x3FU);
  }
  if (length == 4) {
    character -= 0x10000;
    give(0xD800 + (character >> 10));
    pending = static_cast<std::mbstate_t>(0xDC00 + (character & 0x3FFU));
    return 1;
  }
  give(character);
  return character != 0 ? length : 0;
}
#endif

namespace host {

namespace {

std::string utf8(std::wstring_view text) {
  const int wide = static_cast<int>(text.size());
  const int size = WideCharToMultiByte(CP_UTF8, 0, text.data(), wide, nullptr, 0, nullptr, nullptr);
  std::string result(static_cast<std::size_t>(std::max(0, size)), '\0');
  WideCharToMultiByte(CP_UTF8, 0, text.data(), wide, result.data(), size, nullptr, nullptr);
  return result;
}

std::wstring wide(std::string_view text) {
  const int narrow = static_cast<int>(text.size());
  const int size = MultiByteToWideChar(CP_UTF8, 0, text.data(), narrow, nullptr, 0);
  std::wstring result(static_cast<std::size_t>(std::max(0, size)), L'\0');
  MultiByteToWideChar(CP_UTF8, 0, text.data(), narrow, result.data(), size);
  return result;
}

/// As CommandLineToArgvW takes it for one word: backslashes count only in front of quotation marks.
std::wstring quoted(const std::wstring& word) {
  if (!word.empty() && word.find_first_of(L" \t\n\v\"") == std::wstring::npos) return word;
  std::wstring text = L"\"";
  std::size_t backslashes = 0;
  for (const wchar_t c : word) {
    if (c == L'"') text.append(backslashes + 1, L'\\');
    backslashes = c == L'\\' ? backslashes + 1 : 0;
    text += c;
  }
  text.append(backslashes, L'\\');
  return text + L'"';
}

std::string reason() { return std::system_category().message(static_cast<int>(GetLastError())); }

std::atomic<void (*)()> interrupt_handler{nullptr};

BOOL WINAPI interrupted(DWORD) {
  void (*const handler)() = interrupt_handler.exchange(nullptr);
  if (handler == nullptr) return FALSE;  // the system's own handler ends the program
  handler();
  return TRUE;
}

}  // namespace

std::vector<std::string> begin(int argc, char** argv) {
  SetConsoleOutputCP(CP_UTF8);
  int count = 0;
  wchar_t** words = CommandLineToArgvW(GetCommandLineW(), &count);
  if (words == nullptr) return {argv, argv + argc};
  std::vector<std::string> arguments;
  for (int i = 0; i < count; ++i) arguments.push_back(utf8(words[i]));
  LocalFree(words);
  return arguments;
}

void on_interrupt(void (*handler)()) {
  if (interrupt_handler.exchange(handler) == nullptr) {
    SetConsoleCtrlHandler(interrupted, FALSE);
    SetConsoleCtrlHandler(interrupted, TRUE);
  }
}

bool error_output_is_terminal() {
  DWORD mode = 0;
  return GetConsoleMode(GetStdHandle(STD_ERROR_HANDLE), &mode) != 0;
}

std::optional<std::filesystem::path> program_file() {
  std::wstring name(32768, L'\0');
  const DWORD size = GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size()));
  if (size == 0 || size >= name.size()) return std::nullopt;
  name.resize(size);
  return std::filesystem::path(name);
}

Finished run(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  Finished result;
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  HANDLE reading = nullptr, writing = nullptr;
  if (CreatePipe(&reading, &writing, &inherited, 0) == 0) {
    result.failure = reason();
    return result;
  }
  SetHandleInformation(reading, HANDLE_FLAG_INHERIT, 0);
  const std::filesystem::path file = program.empty() ? program_file().value_or(L"npt.exe") : program;
  std::wstring line = quoted(file.wstring());
  for (const std::string& argument : arguments) line += L' ' + quoted(wide(argument));
  STARTUPINFOW start{};
  start.cb = sizeof start;
  start.dwFlags = STARTF_USESTDHANDLES;
  start.hStdInput = GetStdHandle(STD_INPUT_HANDLE);
  start.hStdOutput = writing;
  start.hStdError = GetStdHandle(STD_ERROR_HANDLE);
  PROCESS_INFORMATION child{};
  const bool started =
      CreateProcessW(file.c_str(), line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &start, &child) != 0;
  if (!started) result.failure = reason();
  CloseHandle(writing);
  if (started) {
    char buffer[4096];
    DWORD n = 0;
    while (ReadFile(reading, buffer, sizeof buffer, &n, nullptr) != 0 && n > 0) result.output.append(buffer, n);
    WaitForSingleObject(child.hProcess, INFINITE);
    DWORD status = 0;
    GetExitCodeProcess(child.hProcess, &status);
    CloseHandle(child.hThread);
    CloseHandle(child.hProcess);
    constexpr DWORD status_of_interrupted = 130, ended_by_control_c = 0xC000013A;
    result.interrupted = status == status_of_interrupted || status == ended_by_control_c;
    if (!result.interrupted && status != 0) result.failure = "exit status " + std::to_string(status);
  }
  CloseHandle(reading);
  return result;
}

Apart run_apart(const std::function<std::vector<double>()>& work, const ApartLimits&) {
  Apart result;
  try {
    result.values = work();
    result.done = true;
  } catch (const std::exception& error) {
    std::cerr << "npt: " << error.what() << std::endl;
  }
  result.memory_mb = peak_memory_mb();
  return result;
}

double peak_memory_mb() {
  PROCESS_MEMORY_COUNTERS counters{};
  K32GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters);
  return static_cast<double>(counters.PeakWorkingSetSize) / (1024 * 1024);
}

std::string processor_name() {
  wchar_t name[256];
  DWORD size = sizeof name;
  if (RegGetValueW(HKEY_LOCAL_MACHINE, L"HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0", L"ProcessorNameString",
                   RRF_RT_REG_SZ, nullptr, name, &size) != ERROR_SUCCESS)
    return "unknown";
  return utf8(name);
}

int allowed_processors() {
  DWORD_PTR mine = 0, all = 0;
  if (GetProcessAffinityMask(GetCurrentProcess(), &mine, &all) == 0 || mine == 0)
    return static_cast<int>(std::thread::hardware_concurrency());
  int count = 0;
  for (; mine != 0; mine &= mine - 1) ++count;
  return count;
}

std::optional<double> processor_quota() { return std::nullopt; }

double memory_limit() {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  GlobalMemoryStatusEx(&status);
  return static_cast<double>(status.ullTotalPhys);
}

}  // namespace host

#endif

/* Runs LLVMFuzzerTestOneInput where clang's libFuzzer is not at hand: first every file of the corpus, then seeded
 * mutations of them for a while.
 *
 *   fuzz_x [-t SECONDS] [-s SEED] [-m BYTES] CORPUS...     folders or files; -t 0: the corpus alone
 *
 * Inputs stand in allocations of exactly their size. One that crashes, or takes over 10 s of a processor, is written to
 * crash-NAME-SEED-ROUND in the program's own folder, and the message names it: give that file as CORPUS with -t 0 to
 * see it again. Prints TAP. Exit status: 0 all is well, 2 usage or no corpus, else a crash. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>
#include "base/clock.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);
void __sanitizer_set_death_callback(void (*callback)(void)) __attribute__((weak));

struct input {
	char *name;
	uint8_t *data;
	size_t n;
};

static struct input *corpus;
static size_t n_corpus, max_bytes = 1 << 20;
static uint64_t random_state = 1;

static const uint8_t *current;
static size_t current_n;
static char crash_path[512];

static uint64_t random64(void)
{
	/* splitmix64 */
	uint64_t z = random_state += 0x9e3779b97f4a7c15u;

	z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
	z = (z ^ z >> 27) * 0x94d049bb133111ebu;
	return z ^ z >> 31;
}

static size_t below(size_t n)
{
	return n ? (size_t)(random64() % n) : 0;
}

/* Only calls that are safe within a signal handler. */
static void save_current(void)
{
	static const char text[] = "fuzz: the input is saved as ";
	int fd = open(crash_path, O_WRONLY | O_CREAT | O_TRUNC, 0644);

	if (fd < 0)
		return;
	for (size_t at = 0; at < current_n;) {
		ssize_t n = write(fd, current + at, current_n - at);

		if (n <= 0)
			break;
		at += (size_t)n;
	}
	close(fd);
	if (write(2, text, sizeof text - 1) < 0 || write(2, crash_path, strlen(crash_path)) < 0 || write(2, "\n", 1) < 0)
		_exit(1);
}

static void on_signal(int number)
{
	static const char hang[] = "fuzz: one input took over 10 s of a processor\n";

	if (number == SIGPROF && write(2, hang, sizeof hang - 1) < 0)
		_exit(1);
	save_current();
	if (number == SIGPROF)
		_exit(1);
	signal(number, SIG_DFL);
	raise(number);
}

static void run(const uint8_t *data, size_t n)
{
	static const struct itimerval most = { .it_value = { 10, 0 } }, none;
	uint8_t *exact = malloc(n ? n : 1);

	if (!exact) {
		fprintf(stderr, "fuzz: no memory for %zu bytes\n", n);
		exit(2);
	}
	if (n)
		memcpy(exact, data, n);
	current = exact;
	current_n = n;
	setitimer(ITIMER_PROF, &most, NULL);
	LLVMFuzzerTestOneInput(exact, n);
	setitimer(ITIMER_PROF, &none, NULL);
	free(exact);
}

static void add_file(const char *path)
{
	struct input *grown = realloc(corpus, (n_corpus + 1) * sizeof *corpus), *in;
	FILE *file = fopen(path, "rb");
	long size = 0;

	if (!grown || !file || fseek(file, 0, SEEK_END) || (size = ftell(file)) < 0 || fseek(file, 0, SEEK_SET)) {
		fprintf(stderr, "fuzz: cannot read %s: %s\n", path, strerror(errno));
		exit(2);
	}
	corpus = grown;
	in = &corpus[n_corpus++];
	in->n = (size_t)size;
	in->name = strdup(path);
	in->data = malloc(in->n + 1);
	if (!in->name || !in->data || fread(in->data, 1, in->n, file) != in->n) {
		fprintf(stderr, "fuzz: cannot read %s\n", path);
		exit(2);
	}
	fclose(file);
}

static void add_path(const char *path)
{
	struct dirent **entries;
	struct stat st;
	int n;

	if (stat(path, &st)) {
		fprintf(stderr, "fuzz: cannot read %s: %s\n", path, strerror(errno));
		exit(2);
	}
	if (!S_ISDIR(st.st_mode)) {
		add_file(path);
		return;
	}
	n = scandir(path, &entries, NULL, alphasort);
	for (int i = 0; i < n; i++) {
		char inner[1024];

		snprintf(inner, sizeof inner, "%s/%s", path, entries[i]->d_name);
		if (entries[i]->d_name[0] != '.' && !stat(inner, &st) && S_ISREG(st.st_mode))
			add_file(inner);
		free(entries[i]);
	}
	if (n >= 0)
		free(entries);
}

static void overwrite_integer(uint8_t *data, size_t n)
{
	static const uint64_t values[] = { 0, 1, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff, 0x10000, 0x7fffffff,
		0x80000000, 0xffffffff, 0x7ff0000000000000, 0x7ff8000000000000, 0x7fefffffffffffff, UINT64_MAX };
	size_t size = (size_t)1 << below(4), at;
	uint64_t v = values[below(sizeof values / sizeof values[0])];

	if (size > n)
		return;
	at = below(n - size + 1);
	for (size_t i = 0; i < size; i++)
		data[at + i] = (uint8_t)(v >> 8 * i);
}

/* One small change; `data` has room for max_bytes. */
static size_t mutate(uint8_t *data, size_t n)
{
	const struct input *other = &corpus[below(n_corpus)];
	size_t at = below(n), length;

	switch (below(9)) {
	case 0:
		if (n)
			data[at] ^= (uint8_t)(1u << below(8));
		return n;
	case 1:
		if (n)
			data[at] = (uint8_t)random64();
		return n;
	case 2:
		if (n)
			data[at] = (uint8_t)(data[at] + below(9) - 4);
		return n;
	case 3:
	case 4:
		overwrite_integer(data, n);
		return n;
	case 5: /* cut out */
		length = below(n - at + 1);
		memmove(data + at, data + at + length, n - at - length);
		return n - length;
	case 6: /* cut off */
		return at;
	case 7: /* put in a piece of an input */
		length = below(other->n + 1);
		if (length > max_bytes - n)
			return n;
		memmove(data + at + length, data + at, n - at);
		memcpy(data + at, other->data + below(other->n - length + 1), length);
		return n + length;
	default: /* overwrite with a piece of an input */
		length = below((other->n < n - at ? other->n : n - at) + 1);
		memcpy(data + at, other->data + below(other->n - length + 1), length);
		return n;
	}
}

static double number(const char *text)
{
	char *end;
	double v = strtod(text, &end);

	if (end == text || *end || !(v >= 0)) {
		fprintf(stderr, "fuzz: '%s' is no number\n", text);
		exit(2);
	}
	return v;
}

int main(int argc, char **argv)
{
	static const int signals[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGPROF };
	const char *slash = strrchr(argv[0], '/'), *name = slash ? slash + 1 : argv[0];
	const int folder = slash ? (int)(slash - argv[0]) + 1 : 0; /* characters of argv[0], the last slash included */
	double budget = 10, start;
	unsigned long long seed = 1, round = 0;
	uint8_t *data;
	int option;

	while ((option = getopt(argc, argv, "t:s:m:")) != -1) {
		if (option == 't')
			budget = number(optarg);
		else if (option == 's')
			seed = strtoull(optarg, NULL, 0);
		else if (option == 'm')
			max_bytes = (size_t)number(optarg);
		else
			return 2;
	}
	for (int i = optind; i < argc; i++)
		add_path(argv[i]);
	if (n_corpus == 0) {
		fprintf(stderr, "usage: %s [-t SECONDS] [-s SEED] [-m BYTES] CORPUS...: no file was found\n", name);
		return 2;
	}
	for (size_t i = 0; i < n_corpus; i++)
		max_bytes = corpus[i].n > max_bytes ? corpus[i].n : max_bytes;
	data = malloc(max_bytes + 1);
	if (!data)
		return 2;
	if (__sanitizer_set_death_callback)
		__sanitizer_set_death_callback(save_current);
	for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++)
		if (!__sanitizer_set_death_callback || signals[i] == SIGPROF || signals[i] == SIGABRT)
			signal(signals[i], on_signal);

	for (size_t i = 0; i < n_corpus; i++) {
		snprintf(crash_path, sizeof crash_path, "%.*scrash-%s-corpus-%zu", folder, argv[0], name, i);
		run(corpus[i].data, corpus[i].n);
	}
	start = clock_seconds();
	for (; budget > 0 && clock_seconds() - start < budget; round++) {
		const struct input *in;
		size_t n;

		random_state = seed << 32 ^ round;
		in = &corpus[below(n_corpus)];
		n = in->n;
		memcpy(data, in->data, n);
		for (size_t k = 1 + below(6); k > 0; k--)
			n = mutate(data, n);
		snprintf(crash_path, sizeof crash_path, "%.*scrash-%s-%llu-%llu", folder, argv[0], name, seed, round);
		run(data, n);
	}
	printf("1..1\nok 1 - %s survives %zu files and %llu mutations in %.1f s, seed %llu\n", name, n_corpus, round,
	       clock_seconds() - start, seed);
	for (size_t i = 0; i < n_corpus; i++) {
		free(corpus[i].name);
		free(corpus[i].data);
	}
	free(corpus);
	free(data);
	return 0;
}

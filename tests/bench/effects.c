/* effects PSR-MODEL MODELS OUT CACHE: what each effect of a frame costs, and what accuracy costs. MODELS takes a model that is
 * built once, OUT effects.png and effects.json; CACHE has the real meshes. */
#include "effects.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "ours.h"
#include "report.h"
#include "scene.h"

#define RESOLUTION 1024

static void make_folder(const char *path)
{
	if (mkdir(path, 0777) != 0 && access(path, W_OK) != 0)
		report_die(path, "cannot be made");
}

int main(int argc, char **argv)
{
	struct effects effects = { .name = "dragon", .aim = { -0.1, -0.15, 0 }, .n_threads = ours_threads() };
	char source[4096], json[4096];
	const char *file = "stanford";

	if (argc != 5) {
		fprintf(stderr, "usage: effects PSR-MODEL MODELS OUT CACHE\n");
		return 2;
	}
	make_folder(argv[2]);
	make_folder(argv[3]);
	snprintf(source, sizeof source, "%s/dragon.ply", argv[4]);
	if (access(source, R_OK) != 0) {
		printf("The dragon is not here, make models fetches it; this is the teapot\n");
		effects.name = file = "teapot";
		memset(effects.aim, 0, sizeof effects.aim);
		scene_standard(source, argv[1], argv[2], file);
	}
	effects.source = source;
	effects.out = argv[3];
	effects.model = scene_model(argv[1], argv[2], file, source, RESOLUTION);
	effects_prices(&effects);
	effects_spacing(&effects);
	effects_gaps(&effects);
	psr_model_unref(effects.model);
	snprintf(json, sizeof json, "%s/effects.json", argv[3]);
	report_write(json);
	printf("\nNumbers in %s, effects.png beside it\n", json);
	return 0;
}

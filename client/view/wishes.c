#include "wishes.h"
#include <string.h>

void wishes_init(struct wishes *wishes, uint32_t width, uint32_t height, double fps)
{
	memset(wishes, 0, sizeof *wishes);
	wishes->server = psr_default_server();
	wishes->fps = fps;
	scene_wish_init(&wishes->scene);
	view_wish_init(&wishes->camera);
	quality_wish_init(&wishes->quality, width, height, "good", "lossless");
}

void wishes_fini(struct wishes *wishes)
{
	scene_wish_fini(&wishes->scene);
}

void wishes_add_options(struct optlist *list, struct wishes *wishes, const struct wishes_own *own)
{
	const struct psr_opt server[] = { PSR_OPT_SERVER(wishes->server) };
	const struct psr_opt fps[] = {
		{ .name = "fps", .type = PSR_OPT_REAL, .value = &wishes->fps, .arg = "N", .min = 1, .max = 1000,
		  .help = "Pictures a second to ask the server for while something moves. Between them the last one is shown as "
		          "the present camera sees it." },
	};

	optlist_heading(list, "Models and server", NULL);
	scene_add_model_options(list, &wishes->scene);
	OPTLIST_ADD(list, server);
	optlist_heading(list, own->heading, NULL);
	optlist_add(list, own->option, own->n_options);
	OPTLIST_ADD(list, fps);
	optlist_heading(list, "Camera", "Where it is at first.");
	view_add_options(list, &wishes->camera);
	optlist_heading(list, "Light", NULL);
	scene_add_light_options(list, &wishes->scene);
	optlist_heading(list, "Quality", own->quality_hint);
	quality_add_options(list, &wishes->quality);
	quality_add_splats_option(list, &wishes->quality);
}

int wishes_parse(struct wishes *wishes, const struct psr_cli *cli, int argc, char **argv, int needs_model,
                 struct psr_error *err)
{
	struct psr_msg_frame frame = { .slot = 0 };
	uint8_t color_by = PSR_WIRE_COLOR_OWN;
	int n_files = 0, has_models, code = psr_command_parse("view", cli, argc, argv, &n_files, err);

	if (code != PSR_OK)
		return code;
	has_models = wishes->scene.n_instances > 0 || wishes->scene.file != NULL;
	if (n_files > 1)
		return psr_fail(err, PSR_ERR_ARG, "one file at a time, not %d; psrd --models serves folders", n_files);
	if (n_files == 1 && has_models)
		return psr_fail(err, PSR_ERR_ARG, "a file is viewed alone: leave --model, --instance and --scene out");
	wishes->file = n_files == 1 ? argv[1] : NULL;
	if (has_models || (needs_model && n_files == 0))
		code = scene_check(&wishes->scene, err);
	if (code == PSR_OK)
		code = scene_color_parse(&color_by, wishes->scene.color_by, err);
	if (code == PSR_OK)
		code = view_check(&wishes->camera, err);
	if (code == PSR_OK)
		code = quality_apply(&frame, &wishes->quality, err);
	if (code == PSR_OK)
		code = psr_address_check(wishes->server, err);
	if (code == PSR_OK)
		code = subject_init(&wishes->subject, &wishes->scene, &frame, err);
	wishes->subject.color_by = color_by;
	return code;
}

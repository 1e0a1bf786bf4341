/* What a module hands over is checked before anything is made of it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "import/import.h"

struct plane {
	double knot[2][4], control[4][4], corner[3][2];
	uint32_t triangle[1][3];
	uint8_t rim[1];
	struct psr_patch patch;
};

static struct psr_patch *good(struct plane *p)
{
	*p = (struct plane){ { { 0, 0, 1, 1 }, { 0, 0, 1, 1 } },
		                 { { 0, 0, 0, 1 }, { 0, 1, 0, 1 }, { 1, 0, 0, 1 }, { 1, 1, 0, 1 } },
		                 { { 0, 0 }, { 1, 0 }, { 0.5, 1 } }, { { 0, 1, 2 } }, { 7 }, { .rim = NULL } };
	p->patch = (struct psr_patch){ .degree = { 1, 1 }, .n = { 2, 2 }, .knot = { p->knot[0], p->knot[1] },
		                           .control = p->control, .n_corners = 3, .n_triangles = 1, .corner = p->corner,
		                           .triangle = p->triangle, .rim = p->rim };
	return &p->patch;
}

static void refused(const struct psr_patch *patch, const char *why)
{
	struct psr_error err = { 0, "" };

	assert_int_equal(import_patch_check(patch, 1, &err), PSR_ERR_FORMAT);
	if (strstr(err.text, why) == NULL)
		fail_msg("'%s' does not tell: %s", err.text, why);
}

static void patches_that_break_a_promise_are_refused(void **state)
{
	static const double bad[] = { NAN, INFINITY, -INFINITY, -1e-9, 1.0000001 };
	struct plane p;

	(void)state;
	assert_int_equal(import_patch_check(good(&p), 1, NULL), PSR_OK);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		good(&p)->corner[1][i % 2] = bad[i];
		refused(&p.patch, "corner 1 of a NURBS patch is not within its domain");
	}
	good(&p)->triangle[0][2] = 3;
	refused(&p.patch, "has corners 0, 1, 3 of 3");
	good(&p)->triangle[0][0] = UINT32_MAX;
	refused(&p.patch, "triangle 0");
	memcpy(good(&p)->triangle[0], (const uint32_t[3]){ 0, 2, 1 }, sizeof *p.triangle);
	refused(&p.patch, "or is clockwise");
	good(&p)->material = 1;
	refused(&p.patch, "material 1 of 1");
	good(&p)->n_triangles = 0;
	refused(&p.patch, "0 triangles");
	good(&p)->knot[0][2] = NAN;
	refused(&p.patch, "a knot that is not finite");
	good(&p)->knot[1][3] = 0.5;
	refused(&p.patch, "knots that fall");
	good(&p)->knot[1][1] = 1;
	refused(&p.patch, "without a domain");
	for (int k = 0; k < 3; k++) {
		good(&p)->control[2][k] = INFINITY;
		refused(&p.patch, "a control point that is not finite");
	}
	good(&p)->control[3][3] = INFINITY;
	refused(&p.patch, "a control point that is not finite");
	good(&p)->control[3][3] = -1;
	refused(&p.patch, "a weight that is not positive");
	good(&p)->degree[0] = 16;
	refused(&p.patch, "degree 16");
	good(&p)->n[1] = 1;
	refused(&p.patch, "1 control points");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(patches_that_break_a_promise_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

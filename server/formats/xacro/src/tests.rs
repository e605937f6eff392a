//! Tests of each directive, expression and refusal of xacro. Results were compared with Python's xacro
//! (2.1.1) where possible.

mod files;

use std::fs;

use tempfile::TempDir;

use super::*;

fn robot(content: &str) -> String {
    format!("<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n{content}\n</robot>")
}

/// Expands the content of a robot; returns it without line ends.
fn content(content: &str) -> Result<String, Error> {
    let expanded = expand_text(&robot(content), &BTreeMap::from([("given".to_owned(), "7".to_owned())]))?;
    let urdf = expanded.urdf.replace('\n', "");
    let inner = urdf
        .strip_prefix("<?xml version=\"1.0\"?><robot name=\"r\">")
        .and_then(|urdf| urdf.strip_suffix("</robot>"));
    Ok(inner.unwrap_or_default().to_owned())
}

/// Evaluates an expression.
fn value(expression: &str) -> String {
    let expression = expression.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    match content(&format!("<a b=\"${{{expression}}}\"/>")) {
        Ok(made) => made.trim_start_matches("<a b=\"").trim_end_matches("\"/>").to_owned(),
        Err(error) => panic!("{expression}: {error}"),
    }
}

fn why(text: &str) -> String {
    content(text).unwrap_err().to_string()
}

#[test]
fn expressions_are_those_of_python() {
    for (expression, expected) in [
        ("1 + 2 * 3", "7"),
        ("(1 + 2) * 3", "9"),
        ("7 / 2", "3.5"),
        ("6 / 2", "3.0"),
        ("7 // 2", "3"),
        ("-7 // 2", "-4"),
        ("-7 % 3", "2"),
        ("7.5 % 2", "1.5"),
        ("2 ** 3 ** 2", "512"),
        ("-2 ** 2", "-4"),
        ("2 ** -1", "0.5"),
        ("1e-3 + .5", "0.501"),
        ("1e-7", "1e-07"),
        ("2e20", "2e+20"),
        ("[i * 2 for i in range(3)]", "[0, 2, 4]"),
        ("[a + b for a, b in {'x': 'y'}.items() if a != b]", "['xy']"),
        ("{k: v for k, v in [('a', 1), ('a', 2)]}", "{'a': 2}"),
        ("sum(i for i in [1, 2])", "3"),
        ("[[i, j] for i in range(2) for j in range(i)]", "[[1, 0]]"),
        ("dict(a=1, b='c')['b']", "c"),
        ("dict(a=1).a", "1"),
        ("dict([['a', 1]], a=2)", "{'a': 2}"),
        ("list(map(float, '1 2.5'.split()))", "[1.0, 2.5]"),
        ("map(lambda x, y: x * y, [1, 2], [3, 4])", "[3, 8]"),
        ("map(str.upper, ['a'])", "['A']"),
        ("list(filter(lambda x: x > 1, [1, 2]))", "[2]"),
        ("sorted(['b', 'a'])", "['a', 'b']"),
        ("sorted([1, 3, 2], key=lambda x: -x)", "[3, 2, 1]"),
        ("sorted([1, 3, 2], reverse=True)", "[3, 2, 1]"),
        ("max(['a', 'bcd'], key=len)", "bcd"),
        ("'abcde'[1:3] + 'abcde'[-1:] + 'abc'[::-1]", "bcecba"),
        ("[1, 2, 3][:-1]", "[1, 2]"),
        ("'%d %s %.3f %05.1f %g %%' % (1, 'a', 2.0, 3.14159, 0.5)", "1 a 2.000 003.1 0.5 %"),
        ("'%s' % 'x'", "x"),
        ("None is None and 1 is not None", "True"),
        ("5 & 3 | 8 ^ 1 << 2", "13"),
        ("list(enumerate(['a']))", "[[0, 'a']]"),
        ("list(zip([1, 2], 'ab'))", "[[1, 'a'], [2, 'b']]"),
        ("isinstance('a', str) and not isinstance(1.0, int)", "True"),
        ("[0] * 3", "[0, 0, 0]"),
        ("list(python.set(['a', 'b', 'a']) - python.set(['b']))", "['a']"),
        ("xacro.tokenize('a, b;c')", "['a', 'b', 'c']"),
        ("python.list(reversed([1, 2]))", "[2, 1]"),
        ("100.0", "100.0"),
        ("1 < 2 < 3", "True"),
        ("1 < 2 > 3", "False"),
        ("not 1 == 2 and True", "True"),
        ("0 or 'x'", "x"),
        ("'' and 'x'", ""),
        ("1 if 2 > 1 else 3", "1"),
        ("1 if False else 2 if False else 3", "3"),
        ("'a' + \"b\"", "ab"),
        ("'ab' * 2", "abab"),
        ("'b' in 'abc'", "True"),
        ("4 not in [1, 2, 3]", "True"),
        ("[1, 2.0, 'x'][-1]", "x"),
        ("{'a': {'b': 5}}['a']['b']", "5"),
        ("dict({'a': 1}).a", "1"),
        ("[1, 'a', True, None]", "[1, 'a', True, None]"),
        ("(1, 2)[1]", "2"),
        ("len('abc') + len([1, 2])", "5"),
        ("max(1, 2.5) - min([3, 2])", "0.5"),
        ("abs(-2) + sum([1, 2])", "5"),
        ("round(2.5)", "2"),
        ("round(3.14159, 2)", "3.14"),
        ("int('12') + int(3.9) + float('.5')", "15.5"),
        ("str(1.0) + 'm'", "1.0m"),
        ("range(1, 7, 2)", "[1, 3, 5]"),
        ("sin(0) + cos(0)", "1.0"),
        ("degrees(pi)", "180.0"),
        ("radians(180) == pi", "True"),
        ("math.pi == pi", "True"),
        ("atan2(1, 1) * 4 == pi", "True"),
        ("sqrt(hypot(3, 4) - 1)", "2.0"),
        ("floor(2.7) + ceil(2.1)", "5"),
        ("'A_b'.lower().replace('_', '-').split('-')", "['a', 'b']"),
        ("'x'.startswith('x')", "True"),
        ("','.join(['a', 'b'])", "a,b"),
        ("{'a': 1}.get('b', 2)", "2"),
        ("{'a': 1}.keys()", "['a']"),
        ("xacro.arg('given')", "7"),
    ] {
        assert_eq!(value(expression), expected, "{expression}");
    }
}

#[test]
fn properties_are_computed_when_they_are_used_and_keep_their_type() {
    for (text, expected) in [
        ("<xacro:property name='a' value='2'/><x y='${a / 4}'/>", "<x y=\"0.5\"/>"),
        (
            "<xacro:property name='a' value='${b * 2}'/><xacro:property name='b' value='3'/><x y='${a}'/>",
            "<x y=\"6\"/>",
        ),
        ("<xacro:property name='a' value='1 2 3'/><x y='${a.split()[1]} ${a}'/>", "<x y=\"2 1 2 3\"/>"),
        ("<xacro:property name='a' value='true'/><xacro:if value='${a}'><x/></xacro:if>", "<x/>"),
        (
            "<xacro:property name='a' value='1'/><xacro:property name='a' default='2'/><x y='${a}'/>",
            "<x y=\"1\"/>",
        ),
        ("<xacro:property name='b' default='2'/><x y='${b}'/>", "<x y=\"2\"/>"),
        ("<xacro:property name='a' value=\"${[1, 2]}\"/><x y='${a[1]}'/>", "<x y=\"2\"/>"),
        (
            "<xacro:property name='a'><p/><q r='${1 + 1}'/></xacro:property><x><xacro:insert_block name='a'/></x>",
            "<x><p/><q r=\"2\"/></x>",
        ),
        (
            "<xacro:property name='a' value='${dict({\"b\": 5})}'/><xacro:property name='a' value='${a[\"b\"]}' lazy_eval='false'/><x y='${a}'/>",
            "<x y=\"5\"/>",
        ),
        ("<x><xacro:if value='1'>${xacro.warning('hm')}a${1 + 1}</xacro:if></x>", "<x>a2</x>"),
        ("<x y='$${a} $$(b) $ 5'/>", "<x y=\"${a} $(b) $ 5\"/>"),
        ("<x>${1 + 1} m</x>", "<x>2 m</x>"),
    ] {
        assert_eq!(content(text).unwrap(), expected, "{text}");
    }
}

#[test]
fn arguments_are_the_callers_else_the_files() {
    let text = "<xacro:arg name='given' default='1'/><xacro:arg name='other' default='${1 + 1}'/><x y='$(arg given) $(arg other)'/>";
    assert_eq!(content(text).unwrap(), "<x y=\"7 2\"/>");
    assert!(why("<x y='$(arg none)'/>").contains("the argument \"none\" is not given"));
}

#[test]
fn an_expression_may_hold_commands_which_are_put_in_as_text() {
    for (expression, expected) in [
        ("${2 * $(arg given)}", "14"),
        ("${'$(arg given)' == '7'}", "True"),
        ("${'left_' + '$(arg given)'}", "left_7"),
        ("${$(arg ${'giv' + 'en'}) + 1}", "8"),
        ("$(arg ${'given'})", "7"),
    ] {
        let text = format!("<x y=\"{expression}\"/>");
        assert_eq!(content(&text).unwrap(), format!("<x y=\"{expected}\"/>"), "{expression}");
    }
    assert!(why("<x y='${1 + $(arg none)}'/>").contains("the argument \"none\" is not given"));
    let deep = |levels: usize| format!("<x y='{}given{}'/>", "$(arg ".repeat(levels), ")".repeat(levels));
    assert!(why(&deep(1_000)).contains("nested too deeply"), "{}", why(&deep(1_000)));
    assert!(why(&deep(100_000)).contains("more than 2000000 steps"), "{}", why(&deep(100_000)));
}

#[test]
fn conditions_take_expressions_arguments_and_numbers() {
    for (value, is) in [
        ("true", true),
        ("False", false),
        ("1", true),
        ("0", false),
        ("${1 > 2}", false),
        ("${'x' == 'x'}", true),
        ("$(arg given)", true),
    ] {
        let text = format!(
            "<xacro:if value=\"{value}\"><x/></xacro:if><xacro:unless value=\"{value}\"><y/></xacro:unless>"
        );
        assert_eq!(content(&text).unwrap(), if is { "<x/>" } else { "<y/>" }, "{value}");
    }
    assert!(why("<xacro:if value='maybe'/>").contains("\"maybe\" is neither true nor false"));
}

#[test]
fn macros_have_defaults_blocks_and_local_names() {
    for (text, expected) in [
        (
            "<xacro:macro name='m' params='a b:=2 c=3'><x y='${a} ${b} ${c}'/></xacro:macro><xacro:m a='1' c='4'/>",
            "<x y=\"1 2 4\"/>",
        ),
        (
            "<xacro:macro name='m' params=\"a:='two words' b:=''\"><x y='${a}|${b}'/></xacro:macro><xacro:m/>",
            "<x y=\"two words|\"/>",
        ),
        (
            "<xacro:property name='a' value='1'/><xacro:macro name='m' params='a:=^ b:=^|5'><x y='${a} ${b}'/></xacro:macro><xacro:m/>",
            "<x y=\"1 5\"/>",
        ),
        (
            "<xacro:macro name='m' params='*o **c n'><x n='${n}'><xacro:insert_block name='o'/><xacro:insert_block name='c'/></x></xacro:macro>\
          <xacro:m n='k'><origin xyz='${1 + 1}'/><all><p/><q/></all></xacro:m>",
            "<x n=\"k\"><origin xyz=\"2\"/><p/><q/></x>",
        ),
        (
            "<xacro:macro name='m' params='n'><x y='${n}'/><xacro:if value='${n > 0}'><xacro:m n='${n - 1}'/></xacro:if></xacro:macro><xacro:m n='2'/>",
            "<x y=\"2\"/><x y=\"1\"/><x y=\"0\"/>",
        ),
        (
            "<xacro:macro name='m'><xacro:property name='a' value='1'/><xacro:property name='b' value='${a + 1}' scope='parent'/></xacro:macro>\
          <xacro:m/><x y='${b}'/>",
            "<x y=\"2\"/>",
        ),
        ("<xacro:macro name='xacro:m'><x/></xacro:macro><xacro:m/><xacro:call macro='m'/>", "<x/><x/>"),
        (
            "<x><xacro:attribute name='a' value='${1 + 1}'/></x><xacro:element xacro:name='e${1}' b='2'><c/></xacro:element>",
            "<x a=\"2\"/><e1 b=\"2\"><c/></e1>",
        ),
    ] {
        assert_eq!(content(text).unwrap(), expected, "{text}");
    }
}

#[test]
fn the_robots_own_name_may_be_an_argument_that_it_declares() {
    let text = robot("<xacro:arg name='n' default='arm'/>").replace("\"r\"", "\"$(arg n)\"");
    assert!(expand_text(&text, &BTreeMap::new()).unwrap().urdf.contains("<robot name=\"arm\"/>"));
}

#[test]
fn other_namespaces_are_kept_and_declared_at_the_root() {
    let text =
        "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro' xmlns:g='http://g'><g:x g:y='1'/></robot>";
    let expanded = expand_text(text, &BTreeMap::new()).unwrap();
    assert_eq!(
        expanded.urdf,
        "<?xml version=\"1.0\"?>\n<robot xmlns:g=\"http://g\" name=\"r\">\n<g:x g:y=\"1\"/>\n</robot>\n"
    );
}

#[test]
fn invalid_expressions_are_refused_and_unsupported_ones_are_named() {
    for (text, reason) in [
        ("<x y='${a}'/>", "line 2: \"a\" is not defined, in ${a}"),
        ("<x y='${1 +}'/>", "line 2: the expression ends too early, in ${1 +}"),
        ("<x y='${1 / 0}'/>", "line 2: a division by zero, in ${1 / 0}"),
        ("<x y='${1'/>", "has no closing bracket"),
        ("<x y=\"${open('/etc/passwd')}\"/>", "not supported: the function open()"),
        ("<x y=\"${__import__('os')}\"/>", "not supported: the function __import__()"),
        ("<x y=\"${''.__class__}\"/>", "not supported: the attribute \"__class__\" of a text"),
        ("<x y='${lambda: 1}'/>", "not supported: a function as a text"),
        ("<x y='${(lambda x: x)(1, 2)}'/>", "a lambda with 1 parameters is called with 2 values"),
        ("<x y='${[i for i in range(10000) for j in [1, 2]]}'/>", "gives more than 10000 values"),
        ("<x y=\"${'abc'[::0]}\"/>", "the step of a slice is zero"),
        ("<x y='$(env HOME)'/>", "$(env HOME) is not given: files cannot read your environment"),
        ("<x y='$(eval nothing)'/>", "\"nothing\" is not defined, in $(eval nothing)"),
        ("<x y=\"$(eval ''.__class__)\"/>", "not supported: `__` in $(eval ...)"),
        ("<x y='${2 ** 2 ** 20}'/>", "a whole number is too large"),
        ("<x y=\"${'a' * 100000}\"/>", "a value is longer than 65536 bytes"),
        ("<x y='${range(100000)}'/>", "range() cannot be called with a number"),
        ("<x y='${sqrt(-1)}'/>", "sqrt(-1) has no value"),
        ("<x y='${1 + \"a\"}'/>", "a number and a text cannot be combined"),
        (
            "<xacro:property name='a' value='${a + 1}'/><x y='${a}'/>",
            "the property \"a\" is defined by itself",
        ),
        ("<xacro:m/>", "line 2: there is no macro \"m\""),
        ("<xacro:macro name='m' params='a'/><xacro:m/>", "the call of \"m\" lacks \"a\": it has no default"),
        ("<xacro:macro name='m' params='a'/><xacro:m b='1'/>", "the macro \"m\" has no parameter \"b\""),
        ("<xacro:macro name='m' params='*a'/><xacro:m/>", "lacks the block \"a\""),
        ("<xacro:macro name='m'/><xacro:m><x/></xacro:m>", "has one block too many"),
        ("<xacro:insert_block name='a'/>", "there is no block \"a\""),
        ("<xacro:include filename='/etc/passwd'/>", "is an absolute path outside"),
        ("<xacro:element xacro:name='a b'/>", "\"a b\" cannot be a name in XML"),
        ("<x y=\"${xacro.error('no such arm')}\"/>", "no such arm"),
    ] {
        assert!(why(text).contains(reason), "{text}: {}", why(text));
    }
}

#[test]
fn endless_growth_is_refused() {
    let endless = "<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>";
    assert!(why(endless).contains("nested deeper than 150"), "{}", why(endless));
    let mut doubling = "<xacro:macro name='m0'><x/></xacro:macro>".to_owned();
    for level in 1..40 {
        doubling +=
            &format!("<xacro:macro name='m{level}'><xacro:m{0}/><xacro:m{0}/></xacro:macro>", level - 1);
    }
    assert!(why(&(doubling + "<xacro:m39/>")).contains("more than 2000000 steps"));
    let mut long = "<xacro:property name='p0' value='aaaaaaaaaaaaaaaa'/>".to_owned();
    for level in 1..40 {
        long += &format!("<xacro:property name='p{level}' value='${{p{0} + p{0}}}'/>", level - 1);
    }
    assert!(why(&(long + "<x y='${p39}'/>")).contains("a value is longer than"));
    let brackets = format!("<x y='${{{}1{}}}'/>", "(".repeat(41), ")".repeat(41));
    assert!(why(&brackets).contains("an expression is nested deeper than 40"));
    let sum = |terms: usize| format!("<x y='${{{}1}}'/>", "1+".repeat(terms));
    assert_eq!(content(&sum(300)).unwrap(), "<x y=\"301\"/>");
    assert!(why(&sum(450)).contains("nested too deeply"));
    assert!(why(&sum(600)).contains("more than 1000 words"));
    let mut blocks =
        "<xacro:macro name='b0' params='*b'><x><xacro:insert_block name='b'/></x></xacro:macro>".to_owned();
    for level in 1..140 {
        blocks += &format!(
            "<xacro:macro name='b{level}' params='*b'><xacro:b{0}><x><xacro:insert_block name='b'/></x></xacro:b{0}></xacro:macro>",
            level - 1
        );
    }
    assert!(
        why(&(blocks + "<xacro:b120><x/></xacro:b120>")).contains("the result is nested deeper than 100")
    );
}

#[test]
fn eval_sees_arguments_and_functions_and_gives_a_text() {
    let declared = "<xacro:arg name='n' default='2'/><xacro:arg name='w' default='1.5'/><xacro:arg name='on' default='true'/>";
    for (text, expected) in [
        ("$(eval n == 2)", "True"),
        ("$(eval n + arg('w'))", "3.5"),
        ("$(eval 'a' if on else 'b')", "a"),
        ("$(eval 2 * given)", "14"),
        ("$(eval find('arm') + '/x')", "package://arm/x"),
        ("$(eval sqrt(4) == 2 and list(map(int, [1.5])) == [1])", "True"),
        ("$(eval optenv('NONE', 'd'))", "d"),
    ] {
        let made = content(&format!("{declared}<x y=\"{text}\"/>")).unwrap();
        assert_eq!(made, format!("<x y=\"{expected}\"/>"), "{text}");
    }
    let condition = format!("{declared}<xacro:if value=\"$(eval n == 2)\"><two/></xacro:if>");
    assert_eq!(content(&condition).unwrap(), "<two/>");
}

#[test]
fn variables_of_the_environment_are_their_defaults_or_what_the_caller_gives() {
    let text = robot("<link name='$(optenv ROBOT_NAME my base)'/><link name='x$(optenv NONE)'/>");
    let expanded = expand_text(&text, &BTreeMap::new()).unwrap();
    assert!(expanded.urdf.contains("<link name=\"my base\"/>\n<link name=\"x\"/>"), "{}", expanded.urdf);
    assert!(expanded.messages.iter().any(|message| message.contains("ROBOT_NAME=VALUE")));
    let given = BTreeMap::from([("ROBOT_NAME".to_owned(), "arm".to_owned())]);
    assert!(expand_text(&text, &given).unwrap().urdf.contains("<link name=\"arm\"/>"));
    let lacking = expand_text(&robot("<link name='$(env NONE)'/>"), &given).unwrap_err();
    assert!(lacking.message.contains("NONE=VALUE"), "{lacking}");
}

#[test]
fn properties_have_scopes_and_can_be_removed() {
    for (text, expected) in [
        (
            "<xacro:macro name='m' params='n'><xacro:property name='x' value='${n}' scope='local'/><l n='${x}'/></xacro:macro><xacro:m n='1'/>",
            "<l n=\"1\"/>",
        ),
        (
            "<xacro:property name='a' value='1'/><xacro:property name='a' remove='true'/><xacro:property name='a' default='2'/><x y='${a}'/>",
            "<x y=\"2\"/>",
        ),
    ] {
        assert_eq!(content(text).unwrap(), expected, "{text}");
    }
    let local = "<xacro:macro name='m'><xacro:property name='x' value='1' scope='local'/></xacro:macro><xacro:m/><x y='${x}'/>";
    assert!(why(local).contains("\"x\" is not defined"));
}

#[test]
fn names_of_comprehensions_are_seen_by_no_property() {
    let text = "<xacro:property name='a' value='${i}'/><x y='${[a for i in [1]]}'/>";
    assert!(why(text).contains("\"i\" is not defined"), "{}", why(text));
    let shadows = "<xacro:property name='i' value='5'/><x y='${[i for i in [1]][0]} ${i}'/>";
    assert_eq!(content(shadows).unwrap(), "<x y=\"1 5\"/>");
}

#[test]
fn attributes_of_xacro_are_left_out() {
    assert_eq!(content("<x xacro:note='${nothing}' y='1'/>").unwrap(), "<x y=\"1\"/>");
}

#[test]
fn huge_values_that_share_their_parts_are_compared_in_bounded_time() {
    let mut text =
        "<xacro:property name='p0' value='${[1]}'/><xacro:property name='q0' value='${[1]}'/>".to_owned();
    for level in 1..60 {
        for name in ["p", "q"] {
            let below = format!("{name}{}", level - 1);
            text += &format!("<xacro:property name='{name}{level}' value='${{[{below}, {below}]}}'/>");
        }
    }
    content(&(text + "<x y='${p59 == q59}'/>")).unwrap();
}
